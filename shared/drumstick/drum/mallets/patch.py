"""The junctions under a mallet's tip: how it reads the head and how it pushes it, by the very same shares.

The tip rests on the head as a paraboloid, 1 - (r/R)^2 at r from its middle; R is at least the mesh's spacing, so that
there are always some junctions under it, and at most seven of them. The shares g add up to 1, the head under the tip is
y = sum g u, and a push F counts at each junction as g F: so F does the work F dy, whatever lies beneath. A junction at
the rim has a smaller mass in proportion to its weight, and one under a muffle gives way less, by what the damper takes.

Rows of eight lanes, wherever they begin, two side by side where the tip is wider: compilers make one vector of each.
Kernels: audio thread; no allocation.
"""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import composition
from drumstick.drum.membrane.interpolation import drawn_in
from drumstick.drum.membrane.lattice import MARGIN, TOPOLOGIES
from drumstick.drum.membrane.sweep import Head, is_triangular, is_triangular_type
from drumstick.drum.memory.mallets import TIP_LANES, Patches
from realtime.kernels.jit import ArgumentType, njit, overload

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

MAX_SPACINGS = 7.0
_MIN_SPACINGS = 1.0

Floats = npt.NDArray[np.float32]


@njit()
def radius_on(spacing: float, radius: float) -> float:
    """R as the mesh can have it, in radii of the head."""
    return min(max(radius, _MIN_SPACINGS * spacing), MAX_SPACINGS * spacing)


def _row_height(head: Head) -> float:
    # Between rows, in spacings.
    raise TypeError("compiled code only")


@overload(_row_height)
def _row_height_by_type(head: ArgumentType) -> Callable[[Head], float]:
    height = TOPOLOGIES["triangular" if is_triangular_type(head) else "rectilinear"].row_height
    return lambda head: height


@njit()
def _first_at_least(places: npt.NDArray[np.int64], junction: int) -> int:
    # Of places that rise.
    low, high = 0, places.shape[0]
    while low < high:
        middle = (low + high) // 2
        if places[middle] < junction:
            low = middle + 1
        else:
            high = middle
    return low


@njit()
def _hold(patches: Patches, slot: int, held: Any, share: float) -> None:
    # What holds junctions keeps a share of what the tip does to them; the tip is laid anew when that changes.
    if held is None:  # decided by the type, at compile time
        return
    free = np.float32(1.0 - share)
    for row in range(patches.rows[slot]):
        start = patches.starts[slot, row]
        at = _first_at_least(held, start)
        while at < held.shape[0] and held[at] < start + TIP_LANES:
            patches.free[slot, row, held[at] - start] *= free
            patches.steps[slot, row, held[at] - start] *= free
            at += 1


@njit()
def _row(engine: "Engine", slot: int, row: int, x: float, y: float, reach: float) -> float:
    # One row's shares, their sum still open; x, y and the reach in spacings from the centre. Returns their sum.
    head, patches = engine.head, engine.mallets.patches
    grid = head.grid[0]
    shift = 0.5 * (row & 1) if is_triangular(head) else 0.0
    up, total = row * _row_height(head) - y, 0.0
    first = (grid.centre_row + row) * grid.stride
    left = grid.centre_column + math.ceil(x - shift - reach)
    right = grid.centre_column + math.floor(x - shift + reach)
    while left <= right:
        at = patches.rows[slot]
        begin = min(max(left, 0), grid.stride - TIP_LANES)
        patches.starts[slot, at] = first + begin
        for lane in range(TIP_LANES):
            column = begin + lane
            aside = column - grid.centre_column + shift - x
            share = max(1.0 - (aside * aside + up * up) / (reach * reach), 0.0)
            # Outside the head, or for the lanes beside these.
            if head.weights[first + column] == 0.0 or not left <= column < left + TIP_LANES:
                share = 0.0
            patches.shares[slot, at, lane] = share
            total += share
        patches.rows[slot] = at + 1
        left += TIP_LANES
    return total


@njit()
def place_tip(engine: "Engine", slot: int, x: float, y: float, radius: float) -> tuple[float, float]:
    """Put a tip on the head at (x, y), all in radii; returns how far a newton moves the head under it in a step, and
    the sum of all junctions."""
    head, patches = engine.head, engine.mallets.patches
    h = head.grid[0].spacing
    x, y = drawn_in(x, y, 1.0 - h)
    x, y, reach = x / h, y / h, radius / h
    centre_row = head.grid[0].centre_row
    rows = head.weights.shape[0] // head.grid[0].stride
    first = max(math.ceil((y - reach) / _row_height(head)), MARGIN - centre_row)
    last = min(math.floor((y + reach) / _row_height(head)), rows - 1 - MARGIN - centre_row)
    patches.rows[slot] = 0
    total = 0.0
    for row in range(first, last + 1):
        total += _row(engine, slot, row, x, y, reach)
    for row in range(patches.rows[slot]):
        for lane in range(TIP_LANES):
            share = patches.shares[slot, row, lane] / total
            weight = head.weights[patches.starts[slot, row] + lane]
            patches.shares[slot, row, lane] = patches.free[slot, row, lane] = share
            patches.steps[slot, row, lane] = weight * engine.control[0].force_gain * share
    _hold(patches, slot, composition.held_junctions(engine), composition.held_share(engine))
    compliance, total_step = 0.0, 0.0
    for row in range(patches.rows[slot]):
        for lane in range(TIP_LANES):
            step = float(patches.steps[slot, row, lane])
            compliance += float(patches.shares[slot, row, lane]) * step
            total_step += step
    return compliance, total_step


@njit(fastmath={"contract", "reassoc"})
def _summed(patches: Patches, shares_of: Any, slot: int, values: Floats) -> float:
    total = 0.0
    for row in range(patches.rows[slot]):
        shares = shares_of[slot, row]
        heights = values[patches.starts[slot, row] : patches.starts[slot, row] + TIP_LANES]
        for lane in range(TIP_LANES):
            total += float(shares[lane]) * float(heights[lane])
    return total


@njit()
def under(patches: Patches, slot: int, values: Floats) -> float:
    """sum g u: how high the head stands under the tip."""
    return float(_summed(patches, patches.shares, slot, values))


@njit()
def free_under(patches: Patches, slot: int, values: Floats) -> float:
    """Like `under`, less what a muffle holds."""
    return float(_summed(patches, patches.free, slot, values))


@njit(fastmath={"contract"})
def push(patches: Patches, slot: int, values: Floats, force: float) -> None:
    """Move the junctions under the tip by what `force`, N, moves them in a step."""
    newtons = np.float32(force)
    for row in range(patches.rows[slot]):
        steps = patches.steps[slot, row]
        heights = values[patches.starts[slot, row] : patches.starts[slot, row] + TIP_LANES]
        for lane in range(TIP_LANES):
            heights[lane] += newtons * steps[lane]
