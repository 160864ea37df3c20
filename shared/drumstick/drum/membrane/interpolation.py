"""From a place on the head to the junctions around it, and how near each is: for strikes and pickups.

On the triangular mesh the three corners of the triangle with barycentric shares, on the square one the four corners of
the cell with bilinear ones; the nearest junction is the one with the largest share. Places near or beyond the rim are
drawn in, so that all corners lie on the head. Any thread; no allocation.
"""

import math
from collections.abc import Callable

from drumstick.drum.membrane.lattice import TOPOLOGIES
from drumstick.drum.membrane.sweep import Head, TriangularGrid, is_triangular_type
from realtime.kernels.jit import ArgumentType, njit, overload

_ROW_HEIGHT = TOPOLOGIES["triangular"].row_height
CORNERS = 4  # at most
Corners = tuple[tuple[int, ...], tuple[float, ...]]


@njit()
def drawn_in(x: float, y: float, limit: float) -> tuple[float, float]:
    """(x, y), or the nearest point to it at the distance `limit` from the centre when it lies farther out."""
    distance = math.hypot(x, y)
    if distance <= limit:
        return x, y
    return x * limit / distance, y * limit / distance


@njit()
def _in_triangle(head: Head, x: float, y: float) -> tuple[tuple[int, int, int], tuple[float, float, float]]:
    grid: TriangularGrid = head.grid[0]
    h = float(grid.spacing)
    x, y = drawn_in(x, y, 1.0 - h)
    b = y / (_ROW_HEIGHT * h)
    a = x / h - 0.5 * b  # oblique coordinates along 0 and 60 degrees
    a0, b0 = math.floor(a), math.floor(b)
    fa, fb = a - a0, b - b0
    upper = fa + fb > 1.0
    up = 1 if upper else 0
    shares = (abs(1.0 - fa - fb), 1.0 - fb if upper else fa, 1.0 - fa if upper else fb)
    first = _oblique(head, a0 + up, b0 + up)
    return (first, _oblique(head, a0 + 1, b0), _oblique(head, a0, b0 + 1)), shares


@njit()
def _oblique(head: Head, a: int, b: int) -> int:
    grid = head.grid[0]
    return (grid.centre_row + b) * grid.stride + grid.centre_column + a + (b >> 1)


@njit()
def _in_square(
    head: Head, x: float, y: float
) -> tuple[tuple[int, int, int, int], tuple[float, float, float, float]]:
    grid: TriangularGrid = head.grid[0]
    h = float(grid.spacing)
    x, y = drawn_in(x, y, 1.0 - 1.5 * h)
    a0, b0 = math.floor(x / h), math.floor(y / h)
    fa, fb = x / h - a0, y / h - b0
    at = (grid.centre_row + b0) * grid.stride + grid.centre_column + a0
    shares = ((1.0 - fa) * (1.0 - fb), fa * (1.0 - fb), (1.0 - fa) * fb, fa * fb)
    return (at, at + 1, at + grid.stride, at + grid.stride + 1), shares


def around(head: Head, x: float, y: float) -> Corners:
    """Flat indices of the junctions around (x, y), in radii, and their shares, which add up to 1."""
    raise TypeError("compiled code only")


@overload(around)
def _around_by_type(
    head: ArgumentType, x: ArgumentType, y: ArgumentType
) -> Callable[[Head, float, float], Corners]:
    if is_triangular_type(head):
        return lambda head, x, y: _in_triangle(head, x, y)
    return lambda head, x, y: _in_square(head, x, y)


@njit()
def corners_of(head: Head, x: float, y: float) -> Corners:
    """Like `around`, from Python."""
    return around(head, x, y)
