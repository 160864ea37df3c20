"""The modes of an ideal circular membrane. Any thread; allocates.

A mode is J_m(j r) cos(m phi) or sin(m phi) with j a zero of J_m; its frequency is f01 j/j01. A force F at a point moves
it by q'' + 2 sigma q' + w^2 q = c^2 F shape(point) / norm, with c the speed of waves in radii a second, where the
tension is 1, and norm = pi J_{m+1}(j)^2 for m = 0, half of that for each of a pair (Morse and Ingard, "Theoretical
acoustics", 5.2).
"""

import functools
import math
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import J01

_SPLINE_STEP = 0.15  # radians

Numbers = npt.NDArray[np.float64]


def bessel() -> Any:
    """scipy.special, loaded only where a scene has a bank of modes: it takes a quarter of a second."""
    from scipy import special

    return special


class Modes(NamedTuple):
    """Shapes (P,), the lowest first: the order m of each radial mode, the zero j, its norm."""

    orders: npt.NDArray[np.int64]
    zeros: Numbers
    norms: Numbers


@functools.lru_cache(maxsize=8)
def modes_below(highest: float) -> Modes:
    """All whose zero j is at most `highest` (and the lowest in any case). Kept, read only."""
    special = bessel()
    found: list[tuple[float, int]] = [(J01, 0)]
    order = 0
    while True:
        count = max(1, math.ceil((highest - order) / math.pi) + 1)
        zeros = [float(j) for j in special.jn_zeros(order, count) if j <= highest]
        if not zeros:
            break
        found += [(j, order) for j in zeros if j > J01 + 1e-9]
        order += 1
    found.sort()
    orders = np.array([m for _, m in found], np.int64)
    zeros = np.array([j for j, _ in found])
    norms = math.pi * special.jv(orders + 1, zeros) ** 2 * np.where(orders == 0, 1.0, 0.5)
    for values in (orders, zeros, norms):
        values.setflags(write=False)
    return Modes(orders, zeros, norms)


def shapes_at(modes: Modes, x: float, y: float) -> tuple[Numbers, Numbers]:
    """J_m(j r) cos(m phi) and J_m(j r) sin(m phi) at a place in radii; shapes (P,)."""
    special = bessel()
    radial = special.jv(modes.orders, modes.zeros * min(math.hypot(x, y), 1.0))
    angle = modes.orders * math.atan2(y, x)
    return radial * np.cos(angle), radial * np.sin(angle)


def radial_shapes(modes: Modes, radii: Numbers) -> Numbers:
    """J_m(j r) of each mode at each radius, shape (radii, P), true to 1e-5.

    By a cubic spline through each order's function: the function itself, asked a million times, takes seconds.
    """
    from scipy import interpolate

    special, splines = bessel(), cast(Any, interpolate)
    first, last = float(modes.zeros[-1] * radii[0]), float(modes.zeros[-1] * radii[-1])
    x: Numbers = np.linspace(first, last, math.ceil((last - first) / _SPLINE_STEP) + 1)
    found = np.zeros((len(modes.zeros), len(radii)))  # a mode's own row: it lies together
    for order in range(int(modes.orders.max()) + 1):
        own = modes.orders == order
        found[own] = splines.CubicSpline(x, special.jv(order, x))(np.outer(modes.zeros[own], radii))
    return found.T


def tip_average(modes: Modes, radius: float) -> Numbers:
    """A mode's mean under a mallet's tip, by its shape in the tip's middle: see drumstick.drum.mallets.shares."""
    a = modes.zeros * radius
    return 8.0 * bessel().jv(2, a) / a**2
