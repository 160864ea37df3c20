"""The whole mesh one step on, strip by strip. Any thread; no allocation.

The triangular rows are stored as in a brick wall, so the rows beside a row lie half a spacing to its left or right by
turns; the square ones lie straight. Which it is, is known when the kernel is compiled.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.terms import LEFT, LEVEL, StripBounds, Terms
from realtime.kernels.jit import ArgumentType, array_has, deferred, njit, overload
from realtime.records import Record, Rows, dtype_of

Floats = npt.NDArray[np.float32]


class SquareGrid(Record):
    """Junctions of a square mesh; lengths in radii of the head."""

    spacing: float
    centre_row: int
    centre_column: int
    stride: int


class TriangularGrid(SquareGrid):
    """Junctions of a triangular mesh. It has one field more than `SquareGrid`: its type says what it is."""

    shifted: int


SQUARE, TRIANGULAR = dtype_of(SquareGrid), dtype_of(TriangularGrid)


class Head(NamedTuple):
    """One membrane. Shapes, with J = rows * stride: time_levels (2, J), u- and u by turns; weights (J,); strips (S, 4),
    as lattice.strips_of gives them; grid (1,) of TRIANGULAR or SQUARE."""

    time_levels: Floats
    weights: Floats
    strips: npt.NDArray[np.int64]
    grid: Rows[TriangularGrid]


def is_triangular_type(head: ArgumentType) -> bool:
    """Compile-time form of `is_triangular`, for a head's type."""
    return array_has(head, "grid", "shifted")


def is_triangular(head: Head) -> bool:
    """Known at compile time: is it the triangular mesh?"""
    raise TypeError("compiled code only")


@overload(is_triangular)
def _is_triangular(head: ArgumentType) -> Callable[[Head], bool]:
    found = is_triangular_type(head)
    return lambda head: found


def _of_rows(name: str, side: int) -> Any:
    # numba's own language, which a scene's reader does without.
    def make() -> Any:
        from drumstick.drum.membrane import rows
        from drumstick.drum.membrane.simd import WIDTH

        return getattr(rows, name)(WIDTH, side)

    return deferred(make)


_level, _shifted = _of_rows("step_of", LEVEL), _of_rows("step_of", LEFT)
_level_stretch, _shifted_stretch = _of_rows("stretch_of", LEVEL), _of_rows("stretch_of", LEFT)


@njit()
def bare(u_gain: np.float32, u_old_gain: np.float32) -> Terms:
    """The terms of a head with nothing beside it."""
    return Terms(
        u_gain=u_gain,
        u_old_gain=u_old_gain,
        neighbour_gain=None,
        push=None,
        momentum=None,
        rho=None,
        eta=None,
        extra=None,
        extra_gain=None,
        total=None,
    )


@njit()
def _bounds(head: Head, at: int) -> StripBounds:
    strips = head.strips
    return StripBounds(head.grid[0].stride, strips[at, 0], strips[at, 1], strips[at, 2], strips[at, 3])


@njit(inline=True)
def sweep_strips(head: Head, u: Floats, u_old: Floats, terms: Terms, first: int, end: int) -> float:
    """`sweep` of the strips from `first` to before `end` only; several threads may take some each."""
    found = 0.0
    for at in range(first, end):
        if is_triangular(head):
            found += _shifted(u, u_old, head.weights, _bounds(head, at), terms)
        else:
            found += _level(u, u_old, head.weights, _bounds(head, at), terms)
    return found


@njit()
def sweep(head: Head, u: Floats, u_old: Floats, terms: Terms) -> float:
    """One step, by the forms of `rows`: `u_old` holds u- and receives u+. Returns the sum of u+ if `terms.total`."""
    return sweep_strips(head, u, u_old, terms, 0, head.strips.shape[0])


@njit()
def take_laplacian(head: Head, u: Floats, laplacian: Floats) -> None:
    """Put A u into `laplacian`: the first sweep of the fourth order, where the weights are as the lattice has them."""
    sweep(head, u, laplacian, bare(np.float32(-1.0), np.float32(0.0)))


@njit()
def stretched(
    head: Head, u: Floats, u_old: Floats, share: Floats, terms: Terms
) -> tuple[float, float, float, float]:
    """P, Q, R and T of `rows.stretch_of`, over the whole mesh."""
    p, q, r, t = 0.0, 0.0, 0.0, 0.0
    for at in range(head.strips.shape[0]):
        if is_triangular(head):
            found = _shifted_stretch(u, u_old, head.weights, share, _bounds(head, at), terms)
        else:
            found = _level_stretch(u, u_old, head.weights, share, _bounds(head, at), terms)
        p += found[0]
        q += found[1]
        r += found[2]
        t += found[3]
    return p, q, r, t


@njit()
def laplacian_at(head: Head, u: Floats, at: int, u_gain: float) -> float:
    """w sum - u_gain u at one junction, by its flat index."""
    grid = head.grid[0]
    stride = grid.stride
    around = u[at - 1] + u[at + 1]
    if is_triangular(head):
        odd = (at // stride - grid.centre_row) & 1
        around += (
            u[at - stride - 1 + odd] + u[at - stride + odd] + u[at + stride - 1 + odd] + u[at + stride + odd]
        )
    else:
        around += u[at - stride] + u[at + stride]
    return float(head.weights[at] * around - u_gain * u[at])


@njit()
def largest(u: Floats) -> float:
    """max |u|."""
    top = np.float32(0.0)
    for i in range(u.shape[0]):
        top = max(top, abs(u[i]))
    return float(top)
