"""Page for a blind test by ear: drumstick lab abx KITS [--scenes snare ...], which stroke is the recorded one; or without KITS
drumstick lab abx --meshes roll snare, which sound is of the truest mesh. [--out abx.html]

Writes one page that holds all its sounds, to be opened in a browser, also without a network: for each scene that was made beside a recording,
A is a recorded stroke, B the scene's own at the same place among the dynamics, X one of the two at random. Both are mono, of the same length
and the same RMS level, so that width and loudness betray nothing. With --meshes, for each of these shipped scenes and each of draft, standard and
fine: A is what its stick plays on a mesh of 48 kHz, B the same on that mesh, as docs/accuracy-and-time.md compares them. The page counts how often X is named rightly, and how probable that is by
guessing; it can save the answers as CSV. Nothing is measured here. KITS as in `beside_recordings`.
"""

import argparse
import base64
import io
import json
from collections.abc import Iterator
from pathlib import Path
from string import Template

import numpy as np
import soundfile
from scipy import signal

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.render import render
from drumstick_lab.accuracy import whole
from drumstick_lab.benchmarks.recordings.beside_recordings import (
    RATE_HZ,
    STROKES,
    WORK,
    Numbers,
    speeds_of,
    trimmed,
)
from drumstick_lab.measuring.made_beside import KINDS, place_of, scene_of

SECONDS, FADE_S = 2.0, 0.2
MESHED = ("roll", "accents", "snare")  # of the whole way
_RMS, _PEAK = 0.05, 0.95


def prepared(sound: Numbers, rate_Hz: float) -> Numbers:
    """One channel at RATE_HZ from just before the blow, SECONDS long with a fade at its end, RMS 1."""
    mono = trimmed(sound)
    if rate_Hz != RATE_HZ:
        common = np.gcd(round(rate_Hz), RATE_HZ)
        mono = np.asarray(signal.resample_poly(mono, RATE_HZ // common, round(rate_Hz) // common))
    frames = round(SECONDS * RATE_HZ)
    mono = np.pad(mono[:frames], (0, max(frames - len(mono), 0)))
    fade = round(FADE_S * RATE_HZ)
    mono[-fade:] *= np.linspace(1.0, 0.0, fade)
    return mono / np.sqrt(np.mean(mono**2))


def address(sound: Numbers) -> str:
    """The sound as FLAC in a data address."""
    packed = io.BytesIO()
    soundfile.write(packed, sound, RATE_HZ, format="FLAC")
    return "data:audio/flac;base64," + base64.b64encode(packed.getvalue()).decode()


def pair(recorded: Numbers, ours: Numbers) -> tuple[str, str]:
    """Two prepared sounds as addresses, equally loud, neither clipped."""
    loudest = max(float(np.abs(sound).max()) for sound in (recorded, ours))
    gain = min(_RMS, _PEAK / loudest)
    return address(gain * recorded), address(gain * ours)


RECORDED, TRUEST = (
    ("recorded", "ours", "recorded or computed"),
    ("truest mesh", "this mesh", "the truest or not"),
)


def page(drums: list[dict[str, object]], words: tuple[str, str, str] = RECORDED) -> str:
    """The page for drums as [{"name", "strokes": [[A, B], ...]}]. words: for A, for B, and for what is asked."""
    template = Template(Path(__file__).with_name("abx.html").read_text(encoding="utf-8"))
    a, b, question = words
    return template.substitute(DRUMS=json.dumps(drums).replace("</", "<\\/"), A=a, B=b, QUESTION=question)


def _strokes(kits: Path, name: str) -> list[tuple[str, str]]:
    kind, counterpart = KINDS[name]
    files = WORK[kind][counterpart]
    scene = scene_of(name)
    strokes: list[tuple[str, str]] = []
    for file, speed in zip(files, speeds_of(scene), strict=True):
        sound, rate_Hz = soundfile.read(kits / file, always_2d=True)
        ours = render(scene, [strike_for_speed(scene, speed, place_of(name), 0.0)], SECONDS, RATE_HZ)
        strokes.append(pair(prepared(sound, rate_Hz), prepared(ours.astype(np.float64), RATE_HZ)))
    return strokes


def meshes(name: str) -> Iterator[tuple[str, tuple[str, str]]]:
    """Pairs of a shipped scene's playing, the truest mesh first: the name of the pair and its two addresses."""
    truest = prepared(whole.played_on_mesh(name, "fine", whole.REFERENCE_Hz).astype(np.float64), RATE_HZ)
    for tier in whole.TIERS:
        own = prepared(whole.played_on_mesh(name, tier).astype(np.float64), RATE_HZ)
        yield f"{name}, {tier}", pair(truest, own)


def main() -> None:
    known = sorted(name for name, (_, counterpart) in KINDS.items() if counterpart)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kits", type=Path, nargs="?")
    parser.add_argument("--meshes", nargs="+", choices=MESHED, default=[])
    parser.add_argument("--out", type=Path, default=Path("abx.html"))
    parser.add_argument("--scenes", nargs="+", choices=known, default=known)
    args = parser.parse_args()
    if (args.kits is None) == (not args.meshes):
        parser.error("either KITS or --meshes")
    drums: list[dict[str, object]] = []
    for scene in args.meshes:
        drums += [{"name": name, "strokes": [both]} for name, both in meshes(scene)]
        print(f"{scene}: {len(whole.TIERS)} meshes", flush=True)
    for name in args.scenes if args.kits else ():
        drums.append({"name": name, "strokes": _strokes(args.kits, name)})
        print(f"{name}: {STROKES} strokes", flush=True)
    args.out.write_text(page(drums, TRUEST if args.meshes else RECORDED), encoding="utf-8")
    print(f"{args.out}: {args.out.stat().st_size / 1e6:.1f} MB; open it in a browser")


if __name__ == "__main__":
    main()
