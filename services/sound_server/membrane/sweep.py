"""The whole mesh one step on, row by row. Any thread; no allocation.

The triangular rows are stored as in a brick wall, so the rows beside a row lie half a spacing to its left or right by
turns; the square ones lie straight. Which it is, is known when the kernel is compiled.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.jit import ArgumentType, Records, array_has, njit, overload
from sound_server.membrane import rows
from sound_server.membrane.lanes import WIDTH

Floats = npt.NDArray[np.float32]

# Where a mesh's junctions are; lengths in radii of the head. A square mesh has no `shifted`: its type says what it is.
_PLACES = [("spacing", "f8"), ("centre_row", "i8"), ("centre_column", "i8"), ("stride", "i8")]
SQUARE: np.dtype[Any] = np.dtype(_PLACES, align=True)
TRIANGULAR: np.dtype[Any] = np.dtype([*_PLACES, ("shifted", "i8")], align=True)


class Head(NamedTuple):
    """One membrane. Shapes, with J = rows * stride: planes (2, J), u- and u by turns; weights (J,); spans (rows, 2):
    first column and number of columns, whole vectors; grid (1,) of TRIANGULAR or SQUARE."""

    planes: Floats
    weights: Floats
    spans: npt.NDArray[np.int32]
    grid: Records


def is_triangular_type(head: ArgumentType) -> bool:
    """At compile time: the same of a head's type."""
    return array_has(head, "grid", "shifted")


def is_triangular(head: Head) -> bool:
    """Known at compile time: is it the triangular mesh?"""
    raise TypeError("compiled code only")


@overload(is_triangular)
def _is_triangular(head: ArgumentType) -> Callable[[Head], bool]:
    found = is_triangular_type(head)
    return lambda head: found


_level = rows.step_of(WIDTH, rows.LEVEL)
_left = rows.step_of(WIDTH, rows.LEFT)
_right = rows.step_of(WIDTH, rows.RIGHT)
_level_stretch = rows.stretch_of(WIDTH, rows.LEVEL)
_left_stretch = rows.stretch_of(WIDTH, rows.LEFT)
_right_stretch = rows.stretch_of(WIDTH, rows.RIGHT)


@njit()
def sweep(
    head: Head,
    now: Floats,
    then: Floats,
    now_gain: np.float32,
    then_gain: np.float32,
    ring_gain: Any,
    push: Any,
    momentum: Any,
    kept: Any,
    brake: Any,
    plane: Any,
    plane_gain: Any,
    total: Any,
) -> float:
    """One step, by the forms of `rows`: `then` holds u- and receives u+. Returns the sum of u+ if `total` is given."""
    grid = head.grid[0]
    stride = grid.stride
    found = 0.0
    for row in range(1, head.spans.shape[0] - 1):
        start = row * stride + head.spans[row, 0]
        stop = start + head.spans[row, 1]
        if not is_triangular(head):
            found += _level(
                now, then, head.weights, start, stop, stride, now_gain, then_gain, ring_gain, push, momentum,
                kept, brake, plane, plane_gain, total,
            )  # fmt: skip
        elif (row - grid.centre_row) & 1:
            found += _right(
                now, then, head.weights, start, stop, stride, now_gain, then_gain, ring_gain, push, momentum,
                kept, brake, plane, plane_gain, total,
            )  # fmt: skip
        else:
            found += _left(
                now, then, head.weights, start, stop, stride, now_gain, then_gain, ring_gain, push, momentum,
                kept, brake, plane, plane_gain, total,
            )  # fmt: skip
    return found


@njit()
def stretched(
    head: Head, now: Floats, then: Floats, share: Floats, now_gain: np.float32, momentum: Any, kept: Any
) -> tuple[float, float, float, float]:
    """P, Q, R and T of `rows.stretch_of`, over the whole mesh."""
    grid = head.grid[0]
    stride = grid.stride
    p, q, r, t = 0.0, 0.0, 0.0, 0.0
    for row in range(1, head.spans.shape[0] - 1):
        start = row * stride + head.spans[row, 0]
        stop = start + head.spans[row, 1]
        if not is_triangular(head):
            found = _level_stretch(
                now, then, head.weights, share, start, stop, stride, now_gain, momentum, kept
            )
        elif (row - grid.centre_row) & 1:
            found = _right_stretch(
                now, then, head.weights, share, start, stop, stride, now_gain, momentum, kept
            )
        else:
            found = _left_stretch(
                now, then, head.weights, share, start, stop, stride, now_gain, momentum, kept
            )
        p += found[0]
        q += found[1]
        r += found[2]
        t += found[3]
    return p, q, r, t


@njit()
def bend_at(head: Head, now: Floats, at: int, now_gain: float) -> float:
    """w ring - now_gain u at one junction, by its flat index."""
    grid = head.grid[0]
    stride = grid.stride
    around = now[at - 1] + now[at + 1]
    if is_triangular(head):
        odd = (at // stride - grid.centre_row) & 1
        around += (
            now[at - stride - 1 + odd]
            + now[at - stride + odd]
            + now[at + stride - 1 + odd]
            + now[at + stride + odd]
        )
    else:
        around += now[at - stride] + now[at + stride]
    return float(head.weights[at] * around - now_gain * now[at])


@njit()
def largest(plane: Floats) -> float:
    """max |u|."""
    top = np.float32(0.0)
    for i in range(plane.shape[0]):
        top = max(top, abs(plane[i]))
    return float(top)
