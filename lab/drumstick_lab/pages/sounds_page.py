"""Writes docs/sounds.md, a FLAC file and a spectrogram of each shipped scene: drumstick lab sounds-page.

Each: a stroke at the centre, at half radius and at the rim, then what the scene's own stick plays. What was rendered is
kept in docs/sounds/sounds.json, with a digest of the scene's text, because rendering all takes minutes.
"""

import dataclasses
import hashlib
import io
import json
from typing import Any

from drumstick.scenes.scene_text import parse, shipped_gesture, shipped_names, shipped_text
from drumstick_lab.checkout import DOCS

PAGE = DOCS / "sounds.md"
SOUNDS = DOCS / "sounds"
STORED = SOUNDS / "sounds.json"
RATE_HZ = 48_000
STROKES = ((0.05, 0.0), (0.65, 0.5), (1.25, 0.95))  # when, s, and where on the x axis, radii
ROLL_FROM_S, ROLL_S, END_S = 1.9, 1.6, 4.5
GESTURE_S = 4.0  # of a recorded one
_COLOURS = 40  # a palette makes the files a third as large; the eye sees no difference


def digest(name: str) -> str:
    """Digest of what a file was made from."""
    text = shipped_text(name)
    if gesture := parse(text, name).hand.gesture_file:
        text += shipped_gesture(gesture)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _later(press: Any) -> Any:
    first = press.first_tick + round(ROLL_FROM_S * press.rate_Hz)
    return dataclasses.replace(press, first_tick=first)


def _rendered(name: str) -> dict[str, Any]:
    import numpy as np
    import soundfile
    from PIL import Image

    from drumstick.drum.calibrate import strike_for_speed
    from drumstick.drum.render import render
    from rig.figures.sounds.spectrogram import spectrogram
    from rig.figures.style import drawn_png
    from rig.offline.render import rolled
    from rig.offline.streamed_roll import presses

    scene = parse(shipped_text(name), name)
    speed = 0.5 * scene.strike.full_scale_m_per_s
    blows = [strike_for_speed(scene, speed, x, 0.0, t_s) for t_s, x in STROKES]
    lasts_s, end_s, gesture = ROLL_S, END_S, None
    if scene.hand.gesture == "recorded":
        scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, excitation="streamed"))
        lasts_s, end_s, gesture = GESTURE_S, GESTURE_S + 3.0, shipped_gesture(scene.hand.gesture_file)
    if scene.drum.excitation == "streamed":
        pressed = [_later(press) for press in presses(scene, lasts_s, gesture)]
        own = sum(float(press.forces_N[-1]) == 0.0 for press in pressed)
    else:
        pressed, roll = [], rolled(scene, lasts_s)
        blows += [dataclasses.replace(blow, t_s=blow.t_s + ROLL_FROM_S) for blow in roll]
        own = len(roll)
    sound = render(scene, blows, end_s, RATE_HZ, pressed)
    soundfile.write(SOUNDS / f"{name}.flac", sound, RATE_HZ, subtype="PCM_16", compression_level=1.0)
    with Image.open(io.BytesIO(drawn_png(spectrogram(sound, RATE_HZ, scene.drum.f01_Hz, name)))) as picture:
        few = picture.convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
        few.save(DOCS / "images" / f"sound-{name}.png", optimize=True)
    return {
        "digest": digest(name),
        "strikes": own,
        "duration_s": end_s,
        "peak": round(float(np.abs(sound).max()), 3),
        "rms_dB": round(20.0 * float(np.log10(np.sqrt(np.mean(sound.astype(float) ** 2)))), 1),
    }


def page() -> str:
    """The whole page."""
    stored = json.loads(STORED.read_text(encoding="utf-8"))
    lines = [
        "# What the scenes sound like",
        "",
        "Made by `drumstick lab sounds-page`; do not edit. A stroke at the centre, at half radius and at the rim, each at half of",
        f"full scale, then {ROLL_S:g} s of what the scene's own stick plays. Offline, from the very code that plays live. `paper-roll` is heard by the",
        f"forces that its servo streams, and so are {GESTURE_S:g} s of the gesture of `accents`, whose hand moves a simulated arm.",
        "",
    ]
    for name in shipped_names():
        row = stored[name]
        lines += [
            f"## {name}",
            "",
            str(parse(shipped_text(name), name).words),
            f"[{name}.flac](sounds/{name}.flac): {row['strikes']} strikes of its own, peak {row['peak']:.2f}, "
            f"{row['rms_dB']:.1f} dB rms.",
            "",
            f"![Spectrogram of {name}](images/sound-{name}.png)",
            "",
        ]
    return "\n".join(lines)


def main() -> None:
    """Everything anew."""
    SOUNDS.mkdir(exist_ok=True)
    stored = {name: _rendered(name) for name in shipped_names()}
    STORED.write_text(json.dumps(stored, indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
