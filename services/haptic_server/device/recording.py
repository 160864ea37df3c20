"""Positions over time as CSV text: what `replay` plays and a recorded gesture follows. Pure; control threads.

A line of names, then one row an instant: `t_s` or `t_ns`, and `z_m`; `x_m` and `y_m` if they are there. Other columns
are left alone, so a servo's own trace.csv will do. z_m = 0 is the head; times rise, and count from the first row.
"""

import csv
import math
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

MOST_ROWS = 10_000_000
FARTHEST_M = 1.0
_TIMES = {"t_s": 1.0, "t_ns": 1e-9}
_PLACES = ("x_m", "y_m", "z_m")

Recording = npt.NDArray[np.float64]  # shape (n, 4): t s from 0, x, y, z m


class RecordingError(ValueError):
    """What is wrong, with file, line, column, value, limit and unit."""


class _Table:
    # The rows of one text, and words for what is wrong in the present one.
    def __init__(self, lines: Iterable[str], source: str) -> None:
        self._reader = csv.DictReader(lines)
        self.source = source
        self.names = list(self._reader.fieldnames or ())

    def rows(self) -> Iterable[dict[str, str | None]]:
        return self._reader

    def wrong(self, words: str) -> RecordingError:
        return RecordingError(f"{self.source}:{self._reader.line_num}: {words}")

    def number(self, row: dict[str, str | None], name: str) -> float:
        text = row[name]
        if text is None:
            raise self.wrong(f"{name} is missing in this row")
        try:
            value = float(text)
        except ValueError:
            raise self.wrong(f"{name}: {text!r} is not a number") from None
        if not math.isfinite(value):
            raise self.wrong(f"{name}: {value} is not a finite number")
        return value


def _read(table: _Table, lowest_m: float, highest_m: float) -> list[tuple[float, float, float, float]]:
    time = next((name for name in _TIMES if name in table.names), None)
    if time is None or "z_m" not in table.names:
        has = ", ".join(table.names) or "none"
        raise RecordingError(f"{table.source}: needs the columns t_s (or t_ns) and z_m; it has {has}")
    unit = time.removeprefix("t_")
    limits = dict.fromkeys(_PLACES, (-FARTHEST_M, FARTHEST_M)) | {"z_m": (lowest_m, highest_m)}
    rows: list[tuple[float, float, float, float]] = []
    before = -math.inf
    for row in table.rows():
        t = table.number(row, time)
        if not t > before:
            raise table.wrong(f"{time} does not rise: {t:.15g} {unit} after {before:.15g} {unit}")
        before = t
        place = [table.number(row, name) if name in table.names else 0.0 for name in _PLACES]
        for name, value in zip(_PLACES, place, strict=True):
            low, high = limits[name]
            if not low <= value <= high:
                raise table.wrong(f"{name}: {value:g} m is outside {low:g} .. {high:g} m")
        rows.append((t, place[0], place[1], place[2]))
        if len(rows) > MOST_ROWS:
            raise table.wrong(f"more than {MOST_ROWS} rows; cut it")
    return rows


def recording_of(
    lines: Iterable[str], source: str, lowest_m: float = -FARTHEST_M, highest_m: float = FARTHEST_M
) -> Recording:
    """The recording in `lines`; `source` names it in messages. RecordingError also when z_m is outside the limits."""
    try:
        table = _Table(lines, source)
        rows = _read(table, lowest_m, highest_m)
    except csv.Error as error:
        raise RecordingError(f"{source}: not CSV: {error}") from None
    if len(rows) < 2:
        raise RecordingError(f"{source}: has {len(rows)} rows; a recording needs at least two")
    recording = np.array(rows)
    time = next(name for name in _TIMES if name in table.names)
    recording[:, 0] = (recording[:, 0] - recording[0, 0]) * _TIMES[time]
    return recording
