"""A device that replays positions from a recording: the law answers, nothing moves. For rehearsals and bug reports.

The file is CSV with a line of names: `t_s` or `t_ns`, and `z_m`; `x_m` and `y_m` if it has them; other columns are left
alone, so a servo's own trace.csv will do. It is played from its start again and again, from the head's point of view:
z_m = 0 is the head. Control thread.
"""

import csv
import math
from pathlib import Path

import numpy as np

from haptic_server.device import paced
from haptic_server.device.playback import REPLAY, Recording
from haptic_server.device.protocol import DeviceError, Info
from haptic_server.device.specification import PREMIUM_1_5
from haptic_server.servo import loop
from haptic_server.servo.memory import Servo
from realtime.stop import StopRequest

MOST_ROWS = 10_000_000


def _number(row: dict[str, str], name: str, line: int, path: Path) -> float:
    try:
        value = float(row[name])
    except (TypeError, ValueError):
        raise DeviceError(f"{path}:{line}: {name}: {row[name]!r} is not a number") from None
    if not math.isfinite(value):
        raise DeviceError(f"{path}:{line}: {name}: {value} is not a finite number")
    return value


def read(path: Path) -> Recording:
    """The recording as rows of t, x, y, z; times rise from 0. DeviceError names file, line and column."""
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            table = csv.DictReader(lines)
            names = table.fieldnames or []
            time = next((name for name in ("t_s", "t_ns") if name in names), None)
            if time is None or "z_m" not in names:
                raise DeviceError(
                    f"{path}: needs the columns t_s (or t_ns) and z_m; it has {', '.join(names) or 'none'}"
                )
            scale = 1e-9 if time == "t_ns" else 1.0
            rows: list[tuple[float, float, float, float]] = []
            for line, row in enumerate(table, start=2):
                x, y = (_number(row, name, line, path) if name in names else 0.0 for name in ("x_m", "y_m"))
                rows.append((scale * _number(row, time, line, path), x, y, _number(row, "z_m", line, path)))
                if len(rows) > MOST_ROWS:
                    raise DeviceError(f"{path}: more than {MOST_ROWS} rows; cut it")
    except OSError as error:
        raise DeviceError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise DeviceError(f"{path}: not a text file; give CSV") from None
    recording = np.array(rows).reshape(-1, 4)
    if len(recording) < 2:
        raise DeviceError(f"{path}: has {len(recording)} rows; a recording needs at least two")
    recording[:, 0] -= recording[0, 0]
    falls = np.flatnonzero(np.diff(recording[:, 0]) <= 0.0)
    if len(falls):
        raise DeviceError(f"{path}:{falls[0] + 3}: {time} does not rise")
    return recording


class Replay:
    """The device `replay:FILE`."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.recording = np.zeros((2, 4))

    def open(self) -> None:
        """Read the recording."""
        self.recording = read(self._path)

    def info(self) -> Info:
        """As a PHANTOM, whose guard a rehearsal should meet."""
        seconds = self.recording[-1, 0]
        return Info(
            PREMIUM_1_5,
            (f"replays {self._path}: {len(self.recording)} rows, {seconds:g} s, again and again",),
        )

    def furnish(self, servo: Servo) -> Servo:
        """The servo with what this device moves in it."""
        return servo._replace(plant=np.zeros(1, REPLAY), path=self.recording)

    def rehearse(self, spare: Servo) -> None:
        """Compile the loop and touch every path of it."""
        loop.rehearse(spare)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Pace the ticks until asked to stop."""
        return paced.run(PREMIUM_1_5, servo, stop)

    def close(self) -> None:
        """Nothing is held."""
