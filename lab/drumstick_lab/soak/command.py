"""`drumstick soak`: run one form, judge, print, write."""

import json
import logging
import sys
import tempfile
from pathlib import Path

from drumstick_lab.soak.quicker import quicker
from drumstick_lab.soak.result import Result
from drumstick_lab.soak.samples import Samples
from realtime.stop import StopRequest, on_stop_signals
from rig import extras, scene_file
from rig.exit_status import OURS, CommandError, unavailable
from rig.figures import requirements
from rig.supervision.terminal import Terminal

VIRTUAL_S, REAL_S, REAL_SPEED = 3600.0, 1800.0, 20.0
JSON, CSV, FIGURE = "soak.json", "soak.csv", "soak.png"


def soak(
    scene: str,
    duration_s: float | None,
    speed: float | None,
    real_time: bool,
    as_json: bool,
    out: Path | None,
) -> bool:
    """True when everything passed. Raises CommandError."""
    rate = (REAL_SPEED if real_time else 1.0) if speed is None else speed
    found = scene_file.read(scene)
    scene_file.load(scene)
    text = quicker(found.text, found.source, rate)
    if out is not None:
        extras.require("--out", "figures")
        requirements.require_folder(out)
    stop, terminal = StopRequest(), Terminal()
    on_stop_signals(stop.ask)
    samples = Samples(None if out is None else out / CSV)
    try:
        with tempfile.TemporaryDirectory(prefix="drumstick-soak-") as place:
            result = _form(real_time, text, duration_s, rate, Path(place), samples, terminal, stop)
    except OSError as error:
        unavailable(
            f"the soak ended: {error.strerror or error} (recordings are written to {tempfile.gettempdir()})"
        )
    finally:
        terminal.end_status()
        samples.close()
    if out is not None:
        _write(out, result, scene, samples)
    print(json.dumps(result.as_json(scene), allow_nan=False) if as_json else result.in_words())
    return result.passed


def _form(
    real_time: bool, text: str, duration_s: float | None, speed: float, place: Path, samples: Samples,
    terminal: Terminal, stop: StopRequest,
) -> Result:  # fmt: skip
    if real_time:
        from drumstick_lab.soak import real_time as form

        return form.soak(text, duration_s or REAL_S, speed, place, samples, terminal.status, stop)
    from drumstick_lab.soak import virtual

    logging.disable(logging.WARNING)  # its visitors make mistakes on purpose
    try:
        return virtual.soak(text, duration_s or VIRTUAL_S, speed, place, samples, terminal.status, stop)
    except virtual.ticks.Astray as error:
        raise CommandError(OURS, str(error)) from None
    finally:
        logging.disable(logging.NOTSET)


def _write(out: Path, result: Result, scene: str, samples: Samples) -> None:
    from drumstick_lab.soak.figure import draw

    try:
        (out / JSON).write_text(
            json.dumps(result.as_json(scene), indent=1, allow_nan=False) + "\n", encoding="utf-8"
        )
        draw(samples, result, out / FIGURE)
    except OSError as error:
        unavailable(f"--out {out}: cannot be written: {error.strerror}")
    print(f"written to {out}: {JSON}, {CSV}, {FIGURE}", file=sys.stderr)
