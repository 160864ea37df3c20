"""Zero crossings of a weighted sum of z and its derivatives: every event is one.

Kernels: any thread; no allocation, no exceptions.
"""

import math
from typing import NamedTuple

from drumstick.stick.methods.carry import carry, is_exact
from drumstick.stick.segment import Segment, acceleration_at_start, fastest_rate_in, pulse_acceleration_now
from realtime.kernels.jit import njit

# What z, its first three derivatives and 1 are multiplied with.
Weights = tuple[float, float, float, float, float]

_HALVINGS = 200
_ULPS = 2e-16
_NEAR = 1e-9
_SHRUNK = 0.75  # a zero at an end of the interval stays half of it away while the interval is halved
_MAX_BEND = 1.5  # f f'' over f'^2, beyond which Newton's step is the safer one
# A step shorter than this share of the quickest change, where the sum is as straight, ends at the zero to rounding: the
# method leaves some 1e-12 of the step (it is of fourth order), and Taylor's series 1e-28 of the height.
_SHORT = 1e-4


class Point(NamedTuple):
    """Time into the segment (s), and z with its first six derivatives then."""

    t: float
    z: float
    v: float
    z2: float
    z3: float
    z4: float
    z5: float
    z6: float


@njit()
def _point(seg: Segment, t: float, z: float, v: float, z2: float) -> Point:
    # The rest follows from the equation of motion's derivatives; each waits for the one before as late as it can.
    _, p1, p2, p3, p4 = pulse_acceleration_now(seg.pulses, t)
    r = 2.0 * seg.a
    z3 = (p1 - seg.w2 * v) - r * z2
    z4 = (p2 - seg.w2 * z2) - r * z3
    z5 = (p3 - seg.w2 * z3) - r * z4
    z6 = (p4 - seg.w2 * z4) - r * z5
    return Point(t, z, v, z2, z3, z4, z5, z6)


@njit()
def start_of(seg: Segment) -> Point:
    """The point at which the segment starts."""
    return _point(seg, 0.0, seg.z, seg.v, acceleration_at_start(seg))


@njit()
def point_after(seg: Segment, t: float) -> Point:
    """The point t seconds into the segment."""
    z, v, z2 = carry(seg, t)
    return _point(seg, t, z, v, z2)


@njit()
def stay(p: Point, t: float) -> Point:
    """Copy of the point at a later time, for a stick that rests."""
    return Point(t, p.z, p.v, p.z2, p.z3, p.z4, p.z5, p.z6)


@njit()
def weighted(weights: Weights, p: Point) -> tuple[float, float, float, float]:
    """The sum at a point, and its first three derivatives."""
    c, c1, c2, c3, one = weights
    return (
        (c * p.z + c1 * p.v) + (c2 * p.z2 + c3 * p.z3) + one,
        (c * p.v + c1 * p.z2) + (c2 * p.z3 + c3 * p.z4),
        (c * p.z2 + c1 * p.z3) + (c2 * p.z4 + c3 * p.z5),
        (c * p.z3 + c1 * p.z4) + (c2 * p.z5 + c3 * p.z6),
    )


@njit()
def changes(before: float, after: float) -> bool:
    """True when the sign changes on the way. Reaching 0 is a change, leaving it is none."""
    return before < 0.0 <= after or before > 0.0 >= after


@njit()
def _step(weights: Weights, p: Point) -> float:
    # To the zero by Householder's method: fourth order, with derivatives that the equation of motion gives for nothing.
    # Newton's step where the sum bends too much for that.
    f, f1, f2, f3 = weighted(weights, p)
    if abs(f * f2) < _MAX_BEND * f1 * f1:
        return -f * (6.0 * f1 * f1 - 3.0 * f * f2) / (6.0 * f1 * (f1 * f1 - f * f2) + f * f * f3)
    return -f / f1


@njit()
def _guess(weights: Weights, low: Point, high: Point) -> float:
    # Where the parabola at `low` reaches zero, or half way.
    f, f1, f2, _ = weighted(weights, low)
    under = f1 * f1 - 2.0 * f * f2
    if under >= 0.0:
        t = low.t - 2.0 * f / (f1 - math.copysign(math.sqrt(under), f))
        if low.t < t < high.t:
            return t
    return 0.5 * (low.t + high.t)


@njit()
def _moved(p: Point, h: float) -> Point:
    # By Taylor's series: for a short step exact to rounding, all but the highest derivatives, which only guide.
    h2, h3, h4, h5 = 0.5 * h, (1.0 / 3.0) * h, 0.25 * h, 0.2 * h
    return Point(
        p.t + h,
        p.z + h * (p.v + h2 * (p.z2 + h3 * (p.z3 + h4 * (p.z4 + h5 * p.z5)))),
        p.v + h * (p.z2 + h2 * (p.z3 + h3 * (p.z4 + h4 * (p.z5 + h5 * p.z6)))),
        p.z2 + h * (p.z3 + h2 * (p.z4 + h3 * (p.z5 + h4 * p.z6))),
        p.z3 + h * (p.z4 + h2 * (p.z5 + h3 * p.z6)),
        p.z4 + h * (p.z5 + h2 * p.z6),
        p.z5 + h * p.z6,
        p.z6,
    )


@njit()
def root(seg: Segment, weights: Weights, low: Point, high: Point) -> Point:
    """The point where the sum reaches zero, to the last digits. Its sign changes once between the two.

    Householder's method, safeguarded by bisection: about two points have to be computed.
    """
    begin, end = low.t, high.t
    sign = 1.0 if weighted(weights, low)[0] < 0.0 else -1.0
    t = _guess(weights, low, high)
    short = _SHORT / fastest_rate_in(seg) if is_exact(seg) else 0.0
    previous = math.inf
    here = high
    for _ in range(_HALVINGS):
        here = point_after(seg, t)
        f, f1, f2, _ = weighted(weights, here)
        if f * sign >= 0.0:
            end = t
        else:
            begin = t
        step = _step(weights, here)
        # A zero at an end of the interval is found a little beyond it: that little is rounding, or the method's own.
        to = min(max(t + step, begin), end)
        inside = abs(t + step - to) <= _NEAR * abs(step)
        if abs(step) <= short and abs(f * f2) <= _SHORT * f1 * f1 and inside:
            return _moved(here, step)
        near, shrinks = abs(step) <= _NEAR * t, abs(step) <= _SHRUNK * previous
        if abs(step) <= _ULPS * t or end - begin <= _ULPS * end or (near and not shrinks):
            break  # tiny steps that shrink no more are rounding
        if shrinks and inside:
            t = to
            previous = abs(step)
        elif near:
            t = to
        else:
            t = 0.5 * (begin + end)
            previous = end - begin
    return here
