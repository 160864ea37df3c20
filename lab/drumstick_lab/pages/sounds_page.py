"""Writes docs/sounds.md, a FLAC file and a spectrogram of each shipped scene: drumstick lab sounds-page.

Each: a stroke at the centre, at half radius and at the rim, then what the scene's own stick plays. What was rendered is
kept in docs/sounds/sounds.json, with a digest of the scene's text, the version and a hash of the code that computed it,
because rendering all takes minutes: what is the same in text and code is not rendered anew. Scenes that were
made beside a recorded drum are shown beside it, from the stored result of `beside_recordings`; so is the snare with its
strainer off, which is no scene of its own.
"""

import argparse
import dataclasses
import hashlib
import io
import json
import statistics
from pathlib import Path
from typing import Any

from drumstick.scenes.scene_text import parse, shipped_gesture, shipped_names, shipped_text
from drumstick_lab.checkout import DOCS
from drumstick_lab.measuring.made_beside import BESIDE_ALL, KINDS, scene_of
from drumstick_lab.measuring.provenance import line
from drumstick_lab.measuring.source_hash import source_hash
from drumstick_lab.measuring.stored import commit, read
from drumstick_lab.pages.measured import measured_drums, recording_figure
from drumstick_lab.pages.stored_picture import digest_of, store
from rig.figures import style

PAGE = DOCS / "sounds.md"
IMAGES = DOCS / "images"
SOUNDS = DOCS / "sounds"
STORED = SOUNDS / "sounds.json"
RATE_HZ = 48_000
STROKES = ((0.05, 0.0), (0.65, 0.5), (1.25, 0.95))  # when, s, and where on the x axis, radii
ROLL_FROM_S, ROLL_S, END_S = 1.9, 1.6, 4.5
GESTURE_S = 4.0  # of a recorded one that moves an arm
GRIP_S = 7.0  # of one that moves the hand of the stick itself
# Code that a sound depends on; its scene's text has a digest of its own.
RENDERED_BY = (
    "shared/drumstick/drum", "shared/drumstick/parameters", "shared/drumstick/stick", "shared/realtime/kernels",
)  # fmt: skip
_COLOURS = 40  # a palette makes the files a third as large; the eye sees no difference


def names() -> list[str]:
    """Shipped scenes, and those that are one of them with a part turned off, in order."""
    return sorted({*shipped_names(), *KINDS})


def sound_of(name: str) -> Path:
    """File of its sound."""
    return SOUNDS / f"{_stem(name)}.flac"


def _stem(name: str) -> str:
    return name.replace(", ", "-").replace(" ", "-")


def digest(name: str) -> str:
    """Digest of what a file was made from."""
    text = shipped_text(_shipped(name))
    if gesture := parse(text, name).hand.gesture_file:
        text += shipped_gesture(gesture)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _shipped(name: str) -> str:
    return name.partition(", ")[0]


def kept(stored: dict[str, Any]) -> dict[str, Any]:
    """Rows of what was rendered from the scenes as they are, by the code as it is."""
    code = source_hash(RENDERED_BY)
    return {
        name: row
        for name, row in stored.items()
        if name in names() and row["digest"] == digest(name) and row.get("sources") == code
    }


def _later(press: Any) -> Any:
    first = press.first_tick + round(ROLL_FROM_S * press.rate_Hz)
    return dataclasses.replace(press, first_tick=first)


def _rendered(name: str) -> dict[str, Any]:
    import numpy as np
    import soundfile
    from PIL import Image

    from drumstick.drum.calibrate import strike_for_speed
    from drumstick.drum.render import render
    from drumstick.public.run import simulate
    from rig.figures.sounds.spectrogram import spectrogram
    from rig.figures.style import drawn_png
    from rig.offline.streamed_roll import presses

    scene = scene_of(name)
    speed = 0.5 * scene.strike.full_scale_m_per_s
    blows = [strike_for_speed(scene, speed, x, 0.0, t_s) for t_s, x in STROKES]
    lasts_s, end_s, gesture = ROLL_S, END_S, None
    if scene.hand_moves_stick:
        lasts_s, end_s = GRIP_S, ROLL_FROM_S + GRIP_S + 1.0
    elif scene.hand.gesture == "recorded":
        scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, excitation="streamed"))
        lasts_s, end_s, gesture = GESTURE_S, GESTURE_S + 3.0, shipped_gesture(scene.hand.gesture_file)
    if scene.drum.excitation == "streamed":
        pressed = [_later(press) for press in presses(scene, lasts_s, gesture)]
        own = sum(float(press.forces_N[-1]) == 0.0 for press in pressed)
    else:
        pressed, roll = [], simulate(scene, lasts_s).drum_strikes()
        blows += [dataclasses.replace(blow, t_s=blow.t_s + ROLL_FROM_S) for blow in roll]
        own = len(roll)
    sound = render(scene, blows, end_s, RATE_HZ, pressed)
    soundfile.write(sound_of(name), sound, RATE_HZ, subtype="PCM_16", compression_level=1.0)
    with Image.open(io.BytesIO(drawn_png(spectrogram(sound, RATE_HZ, scene.drum.f01_Hz, name)))) as picture:
        few = picture.convert("RGB").quantize(_COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
        few.save(IMAGES / f"sound-{_stem(name)}.png", optimize=True)
    return {
        "digest": digest(name),
        "version": commit(),
        "sources": source_hash(RENDERED_BY),
        "strikes": own,
        "duration_s": end_s,
        "peak": round(float(np.abs(sound).max()), 3),
        "rms_dB": round(20.0 * float(np.log10(np.sqrt(np.mean(sound.astype(float) ** 2)))), 1),
    }


def _pairs() -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    # Name of a scene -> its drum and the recorded one that it was made beside, as stored.
    found = read("beside_recordings")
    recorded = {name: drum for kind in found["recordings"].values() for name, drum in kind["work"].items()}
    made = {name: drum for name, drum in found["scenes"].items() if drum["made_beside"]}
    return {name: (drum, recorded[drum["made_beside"]]) for name, drum in made.items()}


_MEAN_OF_ALL = {"conga": "mean of five djembes"}


def _pictured() -> dict[str, tuple[dict[str, Any], dict[str, Any]]]:
    # The same, and drums that were fitted to all of a kind beside the mean of their hardest strokes' levels.
    found = read("beside_recordings")
    means: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {}
    for name in BESIDE_ALL:
        hardest = [drum["thirds_dB"][-1] for drum in found["recordings"][KINDS[name][0]]["work"].values()]
        mean = [round(statistics.fmean(levels), 1) for levels in zip(*hardest, strict=True)]
        means[name] = found["scenes"][name], {"thirds_dB": [mean]}
    return {**_pairs(), **means}


def _drawn_from(ours: dict[str, Any], real: dict[str, Any]) -> str:
    made_from = hashlib.sha256(json.dumps([ours["thirds_dB"], real["thirds_dB"]]).encode())
    for module in (recording_figure, style):
        made_from.update(Path(module.__file__).read_bytes())
    return made_from.hexdigest()[:16]


def _picture(name: str) -> Path:
    return IMAGES / f"beside-{_stem(name)}.png"


def stale_pictures() -> list[str]:
    """Scenes whose picture beside a recording is missing, or was drawn from something else."""
    return [name for name, pair in _pictured().items() if digest_of(_picture(name)) != _drawn_from(*pair)]


def _cells(levels: list[float]) -> str:
    return " ".join(f"{level:.0f}" for level in levels)


# What of a scene was tuned to recordings though none is its own, as the history tells.
_TUNED = {
    "tom": "Its stick's tip was fitted to recorded toms on 2026-11-26; to which, and what else of it was, is not told.",
    "conga": "No kit has a conga: fingers and inner loss were fitted to the mean of five recorded djembes, open tones.",
}
_OTHERS = {"hand drum": " of another kit, bongos"}


def _recorded(name: str, ours: dict[str, Any]) -> list[str]:
    # Sentences on what a drum without a recording of its own was tuned to, and is judged by.
    away = ours["distance_dB"].get("held_out", {})
    if not KINDS[name][0]:
        return ["There is no recording to compare with: none of these kits has such a drum."]
    tuned = _TUNED.get(name, "Tuned to no recording.")
    if not away:  # measured without those that are held out
        return [tuned]
    kind, nearest = KINDS[name][0], min(away, key=away.__getitem__)
    return [
        tuned,
        f"From {len(away)} recorded {kind}s{_OTHERS.get(kind, '')}: {ours['median_held_out_dB']:.1f} dB in the median, from the nearest ({nearest})"
        f" {away[nearest]:.1f} dB ([more](measured.md#drums-beside-recorded-ones)).",
    ]


def _alone(name: str, ours: dict[str, Any]) -> list[str]:
    decays = " ".join("-" if value is None else f"{value:.2f}" for value in ours["t60_s"])
    return [
        f"Five strokes at {ours['place']:g} of the radius, the softest first: levels of five frequency bands (0.5-1, 1-2, 2-4, 4-8, 8-16 kHz) relative to the whole stroke;",
        "how much 1-8 kHz rise from the softest to the brightest; and T60 of the hardest in the eight octaves around 63 Hz to 8 kHz.",
        "",
        "| stroke | ours, dB |",
        "|---|---|",
        *(f"| {stroke} | {_cells(levels)} |" for stroke, levels in enumerate(ours["bands_dB"], 1)),
        f"| rise, dB | {ours['rise_dB']:.1f} |",
        f"| T60, s | {decays} |",
        "",
        *_recorded(name, ours),
        "",
        *(_beside_all(name) if name in BESIDE_ALL else []),
    ]


def _beside_all(name: str) -> list[str]:
    return [
        f"Spectra beside the {_MEAN_OF_ALL[name]} (levels in dB). They have one dynamic, so their curve is the same beside each stroke of ours.",
        "",
        f"![{name} beside the {_MEAN_OF_ALL[name]}: spectra of three strokes](images/{_picture(name).name})",
        "",
    ]


def _versions(stored: dict[str, Any]) -> list[str]:
    # By which version of the code the files were rendered: once for all, or each that is not as most.
    of_each = {name: row.get("version") or "not known" for name, row in stored.items()}
    most = statistics.mode(of_each.values())
    others = ", ".join(f"`{name}` {version}" for name, version in of_each.items() if version != most)
    return [
        f"Rendered by version {most} of the code{f'; but {others}' if others else ''}. After a change of drum or stick, `drumstick lab sounds-page` renders anew."
    ]


def _beside(name: str, ours: dict[str, Any], real: dict[str, Any]) -> list[str]:
    strokes = zip(ours["bands_dB"], real["bands_dB"], strict=True)
    rows = [
        f"| {stroke} | {_cells(one)} | {_cells(other)} |" for stroke, (one, other) in enumerate(strokes, 1)
    ]
    decays = [
        " ".join("-" if value is None else f"{value:.2f}" for value in drum["t60_s"]) for drum in (ours, real)
    ]
    recorded = ours["made_beside"].removeprefix("Forzee ").lower() + (" tom" if name.endswith("tom") else "")
    made = (
        "Tuned to lie between two recorded drums of this size: one of the kit `ColomboAcousticDrumkit`, which is brighter, and this one, the"
        if ours.get("made_also_beside")
        else "Tuned by comparison with a recorded drum, the"
    )
    return [
        f"{made} {recorded}",
        "of the kit `ForzeeStereo` in Debian's package `hydrogen-drumkits`. Each row is a stroke, the softest first: the levels of",
        "five frequency bands (0.5-1, 1-2, 2-4, 4-8, 8-16 kHz) relative to the whole stroke. Last row: T60, the time in which the",
        "sound falls by 60 dB, of the hardest stroke, in the eight octaves around 63 Hz to 8 kHz; `-`: too few points to fit a decay.",
        "",
        "| stroke | ours, dB | recorded, dB |",
        "|---|---|---|",
        *rows,
        f"| rise of 1-8 kHz, dB | {ours['rise_dB']:.1f} | {real['rise_dB']:.1f} |",
        f"| T60, s | {decays[0]} | {decays[1]} |",
        "",
        f"![{name} beside its recording: spectra of three strokes](images/{_picture(name).name})",
        "",
    ]


def page() -> str:
    """The whole page."""
    stored = json.loads(STORED.read_text(encoding="utf-8"))
    pairs, measured = _pairs(), read("beside_recordings")["scenes"]
    lines = [
        "# What the scenes sound like",
        "",
        "Made by `drumstick lab sounds-page`; do not edit. Each file: one stroke at the centre, one at half radius, one at the rim, all at",
        f"half of full scale, then {ROLL_S:g} s of the scene's own roll, computed offline by the code that plays live. The roll of `paper-roll`,",
        f"and the written pattern of `accents` ({GESTURE_S:g} s of it, by a hand that moves a simulated arm), drive the drum by the contact",
        f"force itself. Of `grip` it is {GRIP_S:g} s, in which its hand closes and opens.",
        "",
        *_versions(stored),
        "",
        "Some drums were made beside a recorded one, which is shown with them. Whether ears can tell the two apart: `drumstick lab abx KITS`",
        "writes a page for a blind test, with KITS the folder of drum kits of Debian's package `hydrogen-drumkits`.",
        "",
        f"The comparison: {line('beside_recordings')}",
        *measured_drums.kept_rows(read("beside_recordings")),
        "",
    ]
    for name in names():
        row, stem = stored[name], _stem(name)
        words = str(scene_of(name).words)
        lines += [
            f"## {name}",
            "",
            words
            if name in shipped_names()
            else f"The scene `{_shipped(name)}` with its wires off the head.",
            f"[{stem}.flac](sounds/{stem}.flac): {row['strikes']} strikes of its own, peak {row['peak']:.2f}"
            f" of full scale, {row['rms_dB']:.1f} dB rms.",
            "",
            f"![Spectrogram of {name}](images/sound-{stem}.png)",
            "",
            *(
                _beside(name, *pairs[name])
                if name in pairs
                else _alone(name, measured[name])
                if name in measured
                else []
            ),
        ]
    return "\n".join(lines)


def main() -> None:
    """Render what has another scene now, or was rendered by other code; with --all everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--all", action="store_true", help="render each scene anew")
    anew = parser.parse_args().all
    SOUNDS.mkdir(exist_ok=True)
    current = {} if anew else kept(json.loads(STORED.read_text(encoding="utf-8")))
    stored = {name: current.get(name) or _rendered(name) for name in names()}
    STORED.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    for name in stale_pictures():
        ours, real = _pictured()[name]
        beside = ours["made_beside"] or _MEAN_OF_ALL[name]
        store(
            recording_figure.beside_recording(read("beside_recordings")["thirds_Hz"], ours, real, beside),
            _picture(name),
            _drawn_from(ours, real),
        )
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
