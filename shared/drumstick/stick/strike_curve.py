"""The level of a strike from the stick's speed, by the curve of the scene's `[strike]`.

linear: level = speed/full scale. log: level = ln(speed/softest)/ln(full scale/softest), equal steps in dB. table:
straight between points. All within 0 .. 1, and none falls as the speed grows. Kernels: tick thread or any other; no
allocation, no exceptions.
"""

import math
from typing import Annotated

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import quantities
from drumstick.parameters.strike import MAX_POINTS, Strike
from realtime.kernels.jit import njit
from realtime.records import Record, Records, dtype_of

_LINEAR, _LOG, _TABLE = range(3)
_KINDS = quantities(Strike)["curve"].choices


class CurveTable(Record):
    """`span`: ln of full scale to softest; `points` of the table in its first cells."""

    kind: int
    full_scale_m_per_s: float
    softest_m_per_s: float
    span: float
    points: int
    speed_m_per_s: Annotated[npt.NDArray[np.float64], "f8", (MAX_POINTS,)]
    level: Annotated[npt.NDArray[np.float64], "f8", (MAX_POINTS,)]


CURVE = dtype_of(CurveTable)


def curve_of(strike: Strike) -> Records:
    """The scene's curve, shape (1,). Control thread; allocates."""
    curve = np.zeros(1, CURVE)
    curve["kind"] = _KINDS.index(strike.curve)
    curve["full_scale_m_per_s"] = strike.full_scale_m_per_s
    curve["softest_m_per_s"] = strike.softest_m_per_s
    curve["span"] = math.log(strike.full_scale_m_per_s / strike.softest_m_per_s)
    curve["points"] = len(strike.table)
    for at, (speed, level) in enumerate(strike.table):
        curve["speed_m_per_s"][0, at], curve["level"][0, at] = speed, level
    return curve


@njit()
def _between(curve: CurveTable, speed: float) -> float:
    speeds, levels = curve.speed_m_per_s, curve.level
    if not speed > speeds[0]:
        return float(levels[0])
    for at in range(1, curve.points):
        if speed < speeds[at]:
            share = (speed - speeds[at - 1]) / (speeds[at] - speeds[at - 1])
            return float(levels[at - 1] + share * (levels[at] - levels[at - 1]))
    return float(levels[curve.points - 1])


@njit()
def level_of(curve: CurveTable, speed: float) -> float:
    """The level, 0 .. 1, of a strike at `speed` >= 0 m/s."""
    if curve.kind == _LINEAR:
        return float(min(speed / curve.full_scale_m_per_s, 1.0))
    if curve.kind == _LOG:
        if not speed > curve.softest_m_per_s:
            return 0.0
        return float(min(math.log(speed / curve.softest_m_per_s) / curve.span, 1.0))
    return _between(curve, speed)


def level_at(strike: Strike, speed_m_per_s: float) -> float:
    """Like `level_of` outside of kernels, by the same code."""
    return float(level_of(curve_of(strike)[0], speed_m_per_s))
