"""One name for all methods: where the stick is, t seconds into a segment, by the segment's own method.

Kernels: any thread; no allocation.
"""

from collections.abc import Callable
from typing import Any

from drumstick.stick.methods import implicit_midpoint, rk4, semi_implicit_euler, verlet
from drumstick.stick.segment import Segment, acceleration, propagate
from realtime.kernels.jit import is_none, njit, overload

SEMI_IMPLICIT_EULER, VERLET, RK4, IMPLICIT_MIDPOINT = 0, 1, 2, 3
STEPPERS = {
    "semi_implicit_euler": SEMI_IMPLICIT_EULER,
    "verlet": VERLET,
    "rk4": RK4,
    "implicit_midpoint": IMPLICIT_MIDPOINT,
}
ORDERS = {
    "semi_implicit_euler": semi_implicit_euler.ORDER,
    "verlet": verlet.ORDER,
    "rk4": rk4.ORDER,
    "implicit_midpoint": implicit_midpoint.ORDER,
}


@njit(inline=True)
def step(seg: Segment, t: float) -> tuple[float, float]:
    """Position and speed after one step of length t by a stepper."""
    if seg.method == RK4:
        return rk4.step(seg, t)
    if seg.method == VERLET:
        return verlet.step(seg, t)
    if seg.method == IMPLICIT_MIDPOINT:
        return implicit_midpoint.step(seg, t)
    return semi_implicit_euler.step(seg, t)


def carry(seg: Segment, t: float) -> tuple[float, float, float]:
    """Position, speed and acceleration t seconds into the segment: exact, or by one step of length t."""
    raise TypeError("compiled code only")


@overload(carry)
def _carry_by_method(seg: Any, t: Any) -> Callable[[Segment, float], tuple[float, float, float]]:
    def stepped(seg: Segment, t: float) -> tuple[float, float, float]:
        z, v = step(seg, t)
        return z, v, acceleration(seg, t, z, v)

    return (lambda seg, t: propagate(seg, t)) if is_none(seg, "method") else stepped


def is_exact(seg: Segment) -> bool:
    """Known at compile time: does the segment follow the closed form?"""
    raise TypeError("compiled code only")


@overload(is_exact)
def _is_exact(seg: Any) -> Callable[[Segment], bool]:
    exact = is_none(seg, "method")
    return lambda seg: exact
