"""Positions over time as CSV text: what `replay` plays and a recorded gesture follows. Pure; control threads.

A line of names, then one row an instant: `t_s` or `t_ns`, and `z_m`; `x_m` and `y_m` if they are there. A gesture may
have columns of the grip, with `z_m` or instead of it. Other columns are left alone, so a servo's own trace.csv will do.
z_m = 0 is the head; times rise, and count from the first row. Spaces before a value and the mark that some programs put
before the first name (BOM) do no harm.
"""

import csv
import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

MAX_ROWS = 10_000_000
MAX_BYTES = 200_000_000
MAX_M = 1.0
_SHOWN = 200  # characters of what stands there, in a message
_TIMES = {"t_s": 1.0, "t_ns": 1e-9}
_PLACES = ("x_m", "y_m", "z_m")

Recording = npt.NDArray[np.float64]  # shape (n, 4): t s from 0, x, y, z m; of a gesture two more, of its grip
Row = tuple[float, ...]  # the same of one instant


class Bound(NamedTuple):
    """Range of a column of the grip, its unit, and where the range comes from."""

    low: float
    high: float
    unit: str
    why: str


Check = Callable[[Row], str]  # words for what is wrong with a row; empty where nothing is
_NO_BOUNDS: Mapping[str, Bound] = {}


def _no_check(row: Row) -> str:
    return ""


class TrajectoryError(ValueError):
    """Mistake in a recording, with file, line, column, value, limit and unit."""


class _Table:
    # The rows of one text, and words for what is wrong in the present one.
    def __init__(self, lines: Iterable[str], source: str) -> None:
        self._reader = csv.DictReader(lines, skipinitialspace=True)
        self.source = source
        self.names = [name.strip("\ufeff ") for name in self._reader.fieldnames or ()]
        self._reader.fieldnames = self.names
        twice = {name for name in self.names if self.names.count(name) > 1}
        if twice:
            raise TrajectoryError(
                f"{source}: has {', '.join(sorted(twice))[:_SHOWN]} more than once in its first line"
            )

    def rows(self) -> Iterable[dict[str, str | None]]:
        for row in self._reader:
            beyond = cast("list[str] | None", cast(dict[Any, Any], row).get(None))
            if beyond is not None:
                count = len(self.names) + len(beyond)
                raise self.wrong(
                    f"{count} values for {len(self.names)} names; decimals are written with a point"
                )
            yield row

    def wrong(self, words: str) -> TrajectoryError:
        return TrajectoryError(f"{self.source}:{self._reader.line_num}: {words}")

    def number(self, row: dict[str, str | None], name: str) -> float:
        text = row[name]
        if text is None:
            raise self.wrong(f"{name} is missing in this row")
        try:
            value = float(text)
        except ValueError:
            raise self.wrong(f"{name}: {text[:_SHOWN]!r} is not a number") from None
        if not math.isfinite(value):
            raise self.wrong(f"{name}: {value} is not a finite number")
        return value


class _Limits(NamedTuple):
    lowest_m: float
    highest_m: float
    fastest_m_per_s: float
    grip: Mapping[str, Bound]
    check: Check

    def has_place(self, table: _Table) -> bool:
        # A recording is of places; a gesture may be of the grip alone.
        return "z_m" in table.names or any(name in table.names for name in self.grip)


def _place(table: _Table, row: dict[str, str | None], limits: _Limits) -> tuple[float, float, float]:
    place = [table.number(row, name) if name in table.names else 0.0 for name in _PLACES]
    for name, value in zip(_PLACES, place, strict=True):
        low, high = limits[:2] if name == "z_m" and name in table.names else (-MAX_M, MAX_M)
        if not low <= value <= high:
            raise table.wrong(f"{name}: {value:g} m is outside {low:g} .. {high:g} m")
    return place[0], place[1], place[2] if "z_m" in table.names else math.nan


def _grip(table: _Table, row: dict[str, str | None], limits: _Limits) -> Iterable[float]:
    for name, (low, high, unit, why) in limits.grip.items():
        value = table.number(row, name) if name in table.names else math.nan
        if name in table.names and not low <= value <= high:
            raise table.wrong(f"{name}: {value:g} {unit} is outside {low:g} .. {high:g} {unit}: {why}")
        yield value


def _read(table: _Table, limits: _Limits) -> list[Row]:
    time = next((name for name in _TIMES if name in table.names), None)
    if time is None or not limits.has_place(table):
        has = ", ".join(table.names)[:_SHOWN] or "none"
        instead = f"; instead of z_m, {' or '.join(limits.grip)}" if limits.grip else ""
        raise TrajectoryError(
            f"{table.source}: needs the columns t_s (or t_ns) and z_m; it has {has}{instead}"
        )
    rows: list[Row] = []
    first = before = 0.0
    for row in table.rows():
        stamp = table.number(row, time)
        first = first if rows else stamp
        t_s = (stamp - first) * _TIMES[time]
        place = _place(table, row, limits)
        if rows:
            span_s = t_s - rows[-1][0]
            if not span_s > 0.0:
                unit = time.removeprefix("t_")
                raise table.wrong(f"{time} does not rise: {stamp:.15g} {unit} after {before:.15g} {unit}")
            speed = abs(place[2] - rows[-1][3]) / span_s
            if speed > limits.fastest_m_per_s:
                most = limits.fastest_m_per_s
                raise table.wrong(f"z_m: comes here at {speed:.3g} m/s, faster than {most:g} m/s")
        before = stamp
        rows.append((t_s, *place, *_grip(table, row, limits)))
        if wrong := limits.check(rows[-1]):
            raise table.wrong(wrong)
        if len(rows) > MAX_ROWS:
            raise table.wrong(f"more than {MAX_ROWS} rows; cut it")
    return rows


def recording_of(
    lines: Iterable[str],
    source: str,
    lowest_m: float = -MAX_M,
    highest_m: float = MAX_M,
    fastest_m_per_s: float = math.inf,
    grip: Mapping[str, Bound] = _NO_BOUNDS,
    check: Check = _no_check,
) -> Recording:
    """The recording in `lines`; `source` names it in messages. TrajectoryError also when z_m is outside the limits.

    grip: columns that stand beside z_m or instead of it, one more of the recording for each; NaN in one that is absent.
    check: what else a row has to meet.
    """
    try:
        table = _Table(lines, source)
        rows = _read(table, _Limits(lowest_m, highest_m, fastest_m_per_s, grip, check))
    except csv.Error as error:
        raise TrajectoryError(f"{source}: not CSV: {error}") from None
    if len(rows) < 2:
        raise TrajectoryError(f"{source}: has {len(rows)} rows; a recording needs at least two")
    return np.array(rows)
