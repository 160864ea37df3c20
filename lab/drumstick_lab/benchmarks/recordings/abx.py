"""Page for a blind test by ear, which stroke is the recorded one: drumstick lab abx KITS [--out abx.html] [--scenes snare ...].

Writes one page that holds all its sounds, to be opened in a browser, also without a network: for each scene that was made beside a recording,
A is a recorded stroke, B the scene's own at the same place among the dynamics, X one of the two at random. Both are mono, of the same length
and the same RMS level, so that width and loudness betray nothing. The page counts how often X is named rightly, and how probable that is by
guessing; it can save the answers as CSV. Nothing is measured here. KITS as in `beside_recordings`.
"""

import argparse
import base64
import io
import json
from pathlib import Path
from string import Template

import numpy as np
import soundfile
from scipy import signal

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.render import render
from drumstick_lab.benchmarks.recordings.beside_recordings import (
    PLACE,
    RATE_HZ,
    STROKES,
    WORK,
    Numbers,
    speeds_of,
    trimmed,
)
from drumstick_lab.measuring.made_beside import KINDS, scene_of

SECONDS, FADE_S = 2.0, 0.2
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


def page(drums: list[dict[str, object]]) -> str:
    """The page for drums as [{"name", "strokes": [[recorded, ours], ...]}]."""
    template = Template(Path(__file__).with_name("abx.html").read_text(encoding="utf-8"))
    return template.substitute(DRUMS=json.dumps(drums).replace("</", "<\\/"))


def _strokes(kits: Path, name: str) -> list[tuple[str, str]]:
    kind, counterpart = KINDS[name]
    files = WORK[kind][counterpart]
    scene = scene_of(name)
    strokes: list[tuple[str, str]] = []
    for file, speed in zip(files, speeds_of(scene), strict=True):
        sound, rate_Hz = soundfile.read(kits / file, always_2d=True)
        ours = render(scene, [strike_for_speed(scene, speed, PLACE, 0.0)], SECONDS, RATE_HZ)
        strokes.append(pair(prepared(sound, rate_Hz), prepared(ours.astype(np.float64), RATE_HZ)))
    return strokes


def main() -> None:
    known = sorted(name for name, (_, counterpart) in KINDS.items() if counterpart)
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kits", type=Path)
    parser.add_argument("--out", type=Path, default=Path("abx.html"))
    parser.add_argument("--scenes", nargs="+", choices=known, default=known)
    args = parser.parse_args()
    drums: list[dict[str, object]] = []
    for name in args.scenes:
        drums.append({"name": name, "strokes": _strokes(args.kits, name)})
        print(f"{name}: {STROKES} strokes", flush=True)
    args.out.write_text(page(drums), encoding="utf-8")
    print(f"{args.out}: {args.out.stat().st_size / 1e6:.1f} MB; open it in a browser")


if __name__ == "__main__":
    main()
