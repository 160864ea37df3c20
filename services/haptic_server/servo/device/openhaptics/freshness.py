"""Detection of stale positions: the driver has no count of readings that could tell them from new ones.

An arm that lies still is told in the same place for ever, to the last bit, and that is no fault. But a mass does not
stop from one tick to the next, and no hand presses for long without trembling by one count of an encoder: a place that
is told again after it moved, or for a second against a force, is an old one. Tick thread: no allocation, no locks, no
Python, no exceptions.
"""

import math
from typing import Annotated

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

# To stop from here within a tick of 1 ms takes 100 m/s^2: 7.5 N on the 75 g of an arm, and then not a count of rebound.
MOVING_M_PER_S = 0.1
OVER_S = 0.004  # speed is a mean over this: one count of an encoder at 2 kHz is 0.1 m/s, and no movement
# A stick laid down on the head weighs less (75 g), and stays where it is. A hand's force wanders by 1 to 2 % within a
# second: at 3500 N/m more than one count of 0.03 mm and the friction of 0.04 N together hold.
PRESSING_N = 1.0
PRESSING_S = 1.0
_M_PER_MM = 1e-3


class Freshness(Record):
    """place_mm: what was told last; velocity_m_per_s: the mean; same_s: for how long it has been the same; old: taken
    for an old one since it stopped. `known` is 0 before the first reading.
    """

    known: int
    old: int
    same_s: float
    place_mm: Annotated[npt.NDArray[np.float64], "f8", (3,)]
    velocity_m_per_s: Annotated[npt.NDArray[np.float64], "f8", (3,)]


FRESHNESS = dtype_of(Freshness)


@njit()
def _follow(state: Freshness, position_mm: npt.NDArray[np.float64], span_s: float) -> None:
    # The mean velocity goes on over the time since the last place that was another.
    share = 1.0 - math.exp(-span_s / OVER_S)
    for axis in range(3):
        present = (position_mm[axis] - state.place_mm[axis]) * _M_PER_MM / span_s
        state.velocity_m_per_s[axis] += share * (present - state.velocity_m_per_s[axis])
        state.place_mm[axis] = position_mm[axis]


@njit()
def _differs(state: Freshness, position_mm: npt.NDArray[np.float64]) -> bool:
    same_x, same_y = position_mm[0] == state.place_mm[0], position_mm[1] == state.place_mm[1]
    return not (same_x and same_y and position_mm[2] == state.place_mm[2])


@njit()
def _speed(state: Freshness) -> float:
    x, y, z = state.velocity_m_per_s[0], state.velocity_m_per_s[1], state.velocity_m_per_s[2]
    return math.sqrt(x * x + y * y + z * z)


@njit()
def is_new(state: Freshness, position_mm: npt.NDArray[np.float64], force_N: float, span_s: float) -> bool:
    """Check whether this position, shape (3,), finite, is new.

    `force_N` was on the motors over the `span_s` before it.
    """
    if state.known == 0:
        state.known = 1
        for axis in range(3):
            state.place_mm[axis] = position_mm[axis]
        return True
    if _differs(state, position_mm):
        if state.same_s + span_s > 0.0:
            _follow(state, position_mm, state.same_s + span_s)
        state.same_s = 0.0
        state.old = 0
        return True
    if state.same_s == 0.0 and _speed(state) > MOVING_M_PER_S:
        state.old = 1
    state.same_s += span_s
    return state.old == 0 and not (abs(force_N) > PRESSING_N and state.same_s > PRESSING_S)
