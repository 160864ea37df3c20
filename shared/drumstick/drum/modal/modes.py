"""The modes of an ideal circular membrane. Any thread; allocates.

A mode is J_m(j r) cos(m phi) or sin(m phi) with j a zero of J_m; its frequency is f01 j/j01. A force F at a point moves
it by q'' + 2 sigma q' + w^2 q = c^2 F shape(point) / norm, with c the speed of waves in radii a second, where the
tension is 1, and norm = pi J_{m+1}(j)^2 for m = 0, half of that for each of a pair (Morse and Ingard, "Theoretical
acoustics", 5.2).
"""

import functools
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import J01

_TABLE_STEP, _CLOSE_STEP = 0.1, 0.02  # radians: a cubic between them is true to 1e-6, 3e-9

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


def _table(orders: int, x: Numbers) -> Numbers:
    # J_m(x) of all orders below, shape (orders, x). Miller's way: J_{m-1} = 2 m J_m/x - J_{m+1} down from an order at
    # which all are next to nothing, to a common factor, and J_0 + 2 (J_2 + J_4 + ...) = 1. scipy's own takes 2 us
    # a value.
    size = np.maximum(np.abs(x), 1e-30)
    begin = 2 * math.ceil(0.5 * max(float(size.max()), orders) + 5.0 * math.cbrt(float(size.max())) + 10.0)
    found, even = np.zeros((orders, len(x))), np.zeros(len(x))
    above, here = np.zeros(len(x)), np.full(len(x), 1e-300)
    for m in range(begin, 0, -1):
        above, here = here, 2.0 * m / size * here - above
        if m <= orders:
            found[m - 1] = here
        if m % 2:
            even += here
        large = np.abs(here) > 1e100
        if large.any():
            for each in (above, here, even):
                each[large] *= 1e-200
            found[m - 1 :, large] *= 1e-200
    found /= 2.0 * even - here
    found[1::2, x < 0.0] *= -1.0
    return found


@functools.lru_cache(maxsize=8)
def modes_below(highest: float) -> Modes:
    """All whose zero j is at most `highest` (and the lowest in any case). Kept, read only."""
    jv = bessel().jv
    # Zeros of an order lie 3 apart at least, so a step of 0.2 misses none. A chord crosses 0 within 0.001 of one; two
    # of Newton's steps, with J_m' = m J_m/x - J_{m+1}, leave only rounding.
    x = np.arange(1.0, max(highest, J01) + 1.0, 0.2)
    table = _table(max(math.floor(highest), 0) + 1, x)
    orders, before = np.nonzero((table[:, :-1] < 0.0) != (table[:, 1:] < 0.0))
    left, right = table[orders, before], table[orders, before + 1]
    zeros: Numbers = x[before] + (x[1] - x[0]) * left / (left - right)
    for _ in range(2):
        value = jv(orders, zeros)
        zeros -= value / (orders / zeros * value - jv(orders + 1, zeros))
    zeros[0] = J01
    kept = np.flatnonzero(zeros <= max(highest, J01))
    kept = kept[np.argsort(zeros[kept])]
    zeros, orders = zeros[kept], orders[kept]
    norms = math.pi * jv(orders + 1, zeros) ** 2 * np.where(orders == 0, 1.0, 0.5)
    for values in (orders, zeros, norms):
        values.setflags(write=False)
    return Modes(orders, zeros, norms)


def shapes_at(modes: Modes, x: float, y: float) -> tuple[Numbers, Numbers]:
    """J_m(j r) cos(m phi) and J_m(j r) sin(m phi) at a place in radii; shapes (P,)."""
    special = bessel()
    radial = special.jv(modes.orders, modes.zeros * min(math.hypot(x, y), 1.0))
    angle = modes.orders * math.atan2(y, x)
    return radial * np.cos(angle), radial * np.sin(angle)


def between(at: Numbers, columns: int) -> tuple[npt.NDArray[np.int64], Numbers]:
    """The first of the four columns of a table that each place is read between, and a cubic's weights, (4, ...)."""
    first = np.clip(np.floor(at).astype(np.int64) - 1, 0, columns - 4)
    t = at - first
    a, b, c = t - 1.0, t - 2.0, t - 3.0
    return first, np.array([a * b * c / -6.0, t * b * c / 2.0, t * a * c / -2.0, t * a * b / 6.0])


def _read(cells: Numbers, first: npt.NDArray[np.int64], weights: Numbers) -> Numbers:
    found: Numbers = weights[0] * cells[first]
    for i, weight in enumerate(weights[1:], 1):
        found += weight * cells[first + i]
    return found


@functools.lru_cache(maxsize=4)
def _close_table(orders: int, reach: int) -> Numbers:
    return _table(orders, np.linspace(0.0, reach, round(reach / _CLOSE_STEP) + 1))


def bessel_between(order: int, x: Numbers) -> Numbers:
    """J_m(x) of one order, x above 0: read between the columns of a table that is kept."""
    reach = 256 * math.ceil((float(x.max()) + 1.0) / 256.0)
    table = _close_table(64 * (order // 64 + 1), reach)[order]  # few tables, for all who ask
    column, weights = between(x / _CLOSE_STEP, len(table))
    return _read(table, column, weights)


def radial_shapes(modes: Modes, radii: Numbers) -> Numbers:
    """J_m(j r) of each mode at each radius, shape (radii, P), read between the columns of a table."""
    ends = np.multiply.outer(modes.zeros[[0, -1]], radii) / _TABLE_STEP
    first, last = math.floor(float(ends.min())) - 1, math.floor(float(ends.max())) + 3
    table = _table(int(modes.orders.max()) + 1, _TABLE_STEP * np.arange(first, last, dtype=np.float64))
    cells, rows = table.ravel(), modes.orders * table.shape[1]
    found = np.empty((len(radii), len(modes.zeros)))
    for shapes, radius in zip(found, radii, strict=True):
        column, weights = between(modes.zeros * (radius / _TABLE_STEP) - first, table.shape[1])
        shapes[:] = _read(cells, rows + column, weights)
    return found


def tip_average(modes: Modes, radius: float) -> Numbers:
    """A mode's mean under a mallet's tip, by its shape in the tip's middle: see drumstick.drum.mallets.shares."""
    a = modes.zeros * radius
    return 8.0 * bessel().jv(2, a) / a**2
