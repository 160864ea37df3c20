"""The path of a simulated hand: where it wants the stick, over time.

A hand is a spring and a damper to a moving point (K_hand, R_out of equation (1)); the point z_hand(t) is the gesture.
A hand whose K_hand and R_out move too: drumstick.stick.moving_hand.
Tick thread: no allocation, no locks, no Python, no exceptions.
"""

import math

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

HOLD, STROKES, SINGLE, DOUBLE, PRESS, RECORDED = 0, 1, 2, 3, 4, 5
GESTURES = ("hold", "strokes", "single-stroke-roll", "double-stroke-roll", "press", "recorded")
LIFTED_S = 0.3  # every gesture begins with a rest where it starts: lifted, or nothing would be rendered


class Gesture(Record):
    """Motion of a simulated hand: the kind of its gesture, heights (m), times (s), and the way over the head."""

    kind: int
    rest_m: float
    height_m: float
    period_s: float
    orbit_radius: float
    orbit_period_s: float


GESTURE = dtype_of(Gesture)


@njit()
def _swing(share: float) -> float:
    # A raised cosine: 1 at the start of a period, 0 in its middle.
    return 0.5 + 0.5 * math.cos(2.0 * math.pi * share)


@njit()
def place_on(path: npt.NDArray[np.float64], t: float) -> tuple[int, float]:
    """Row of a path at t s or before it, and the share of the way to the next; times (s) are the first column.

    The path repeats.
    """
    n = path.shape[0]
    t = path[0, 0] + t % (path[n - 1, 0] - path[0, 0])
    low, high = 0, n - 1
    while high - low > 1:
        middle = (low + high) // 2
        if path[middle, 0] <= t:
            low = middle
        else:
            high = middle
    return low, (t - path[low, 0]) / (path[high, 0] - path[low, 0])


@njit()
def between(path: npt.NDArray[np.float64], column: int, row: int, share: float) -> float:
    """Value of a column there, straight between rows."""
    return path[row, column] + share * (path[row + 1, column] - path[row, column])


@njit()
def _recorded(path: npt.NDArray[np.float64], t: float) -> float:
    # path has shape (n, 2): times s and heights m; it repeats.
    row, share = place_on(path, t)
    return between(path, 1, row, share)


@njit()
def later(gesture: Gesture, path: npt.NDArray[np.float64], t: float, span_s: float) -> float:
    """Time in its gesture, s, of a hand that was at t s, `span_s` later; after the lift it starts again each period.

    A time that only grew would be rounded ever more coarsely: after a month its rate is 1.6e-7 off at 1 kHz.
    """
    t += span_s
    period = path[path.shape[0] - 1, 0] - path[0, 0] if gesture.kind == RECORDED else gesture.period_s
    over = t - LIFTED_S
    if over >= period:
        t -= period * math.floor(over / period)
    return t


@njit()
def hand_at(gesture: Gesture, path: npt.NDArray[np.float64], t: float) -> float:
    """z_hand in m, t s after the gesture began: rest_m is the lowest point, height_m what it lifts above that."""
    rest, height = gesture.rest_m, gesture.height_m
    if t < LIFTED_S:
        return path[0, 1] if gesture.kind == RECORDED else rest + height
    t -= LIFTED_S
    share = t / gesture.period_s
    share -= math.floor(share)
    kind = gesture.kind
    if kind == STROKES:  # a blow each period, the stick held up most of the time
        return rest + height * max(_swing(share), min(1.0, 4.0 * abs(share - 0.5)))
    if kind == SINGLE:
        return rest + height * _swing(share)
    if (
        kind == DOUBLE
    ):  # one arm movement, the stick bounces a second time: the hand stays low for half a period
        return rest + height * max(0.0, 2.0 * _swing(share) - 1.0)
    if kind == PRESS:  # down and held there, up again
        return rest + height * min(1.0, max(0.0, 8.0 * abs(share - 0.5) - 1.0))
    if kind == RECORDED:
        return _recorded(path, t)
    return rest
