"""Where the junctions of the triangular mesh lie, and how the rim weighs on them.

Rows of junctions are stored as in a brick wall: odd rows (counted from the centre's row) are shifted by half a
spacing. Around every row is room that stays exactly 0, and rows are whole numbers of 16 lanes, so the sweep needs
neither a mask nor a remainder loop. Lengths here are in radii of the head; the centre of the head is a junction.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

LANES = 16  # one 64-byte cache line of float32
J01 = 2.404825557695773  # first zero of the Bessel function J0
LAMBDA = math.sqrt(2.0 / 3.0)  # Courant number c T / h at tau = 4 lambda^2 = 8/3, the limit of stability
_ROW_HEIGHT = math.sqrt(3.0) / 2.0  # of the spacing
_RIM = 1.0 - 1e-9  # squared: a junction on the rim itself would have an infinite admittance
# The six neighbours' directions, in radians.
_DIRECTIONS = tuple(k * math.pi / 3.0 for k in range(6))


@dataclass(frozen=True)
class Lattice:
    """Junctions of a clamped circular head.

    `weights` (float64) and everything that is stored per junction have shape (rows, stride); `spans` (int32) has
    shape (rows, 2): first column and number of columns of the padded row, both multiples of 16. The first and last
    rows are empty. `spacing` is h / radius. Odd rows by `centre_row` are shifted by +h/2.
    """

    spacing: float
    centre_row: int
    centre_column: int
    weights: npt.NDArray[np.float64]
    spans: npt.NDArray[np.int32]

    @property
    def junctions(self) -> int:
        """Number of junctions inside the head."""
        return int(np.count_nonzero(self.weights))

    @property
    def across(self) -> float:
        """Junctions across the diameter, a real number."""
        return 2.0 / self.spacing

    def position(self, row: int, column: int) -> tuple[float, float]:
        """x, y of a junction in radii."""
        shift = 0.5 * ((row - self.centre_row) & 1)
        x = (column - self.centre_column + shift) * self.spacing
        return x, (row - self.centre_row) * _ROW_HEIGHT * self.spacing


def spacing_for(f01_Hz: float, mesh_rate_Hz: float) -> float:
    """h / radius that tunes the lowest mode to f01: h = c T / lambda and c = 2 pi radius f01 / j01."""
    return 2.0 * math.pi * f01_Hz / (J01 * LAMBDA * mesh_rate_Hz)


def _rim_weights(x: npt.NDArray[np.float64], y: float, h: float) -> npt.NDArray[np.float64]:
    # w = 1 / (neighbours inside + sum over cut edges of 1/theta), theta = distance to the circle along the edge / h:
    # the junction equation with admittance 1/theta on the cut edges. It makes the radius a real number.
    inside = x * x + y * y < _RIM
    admittance = np.zeros_like(x)
    for angle in _DIRECTIONS:
        dx, dy = h * math.cos(angle), h * math.sin(angle)
        cut = inside & ((x + dx) ** 2 + (y + dy) ** 2 >= _RIM)
        # |p + theta d| = 1 for the direction d of length h
        along = x * dx + y * dy
        room = np.where(cut, along**2 + h * h * (1.0 - x * x - y * y), 1.0)
        theta = np.where(cut, (np.sqrt(room) - along) / (h * h), 1.0)
        admittance += 1.0 / theta
    return np.where(inside, 1.0 / admittance, 0.0)


def lattice_of(spacing: float) -> Lattice:
    """Lay junctions `spacing` radii apart. ValueError for fewer than about 4 across: that is no drum any more."""
    if not 1e-3 <= spacing <= 0.5:
        raise ValueError(f"junctions {spacing:g} radii apart: the mesh takes 0.001 .. 0.5")
    half_rows = math.ceil(1.0 / (_ROW_HEIGHT * spacing))
    half_columns = math.ceil(1.0 / spacing) + 1
    rows = 2 * half_rows + 3
    # The last lane of a row is never inside: it is the left neighbour of the next row's first lane.
    stride = (2 * half_columns + 1 + LANES) // LANES * LANES
    centre_row = half_rows + 1
    weights = np.zeros((rows, stride))
    spans = np.zeros((rows, 2), np.int32)
    for row in range(1, rows - 1):
        shift = 0.5 * ((row - centre_row) & 1)
        x = (np.arange(stride, dtype=np.float64) - half_columns + shift) * spacing
        weights[row] = _rim_weights(x, (row - centre_row) * _ROW_HEIGHT * spacing, spacing)
        inside = np.flatnonzero(weights[row])
        if len(inside):
            first = int(inside[0]) // LANES * LANES
            spans[row] = first, (int(inside[-1]) + LANES) // LANES * LANES - first
    return Lattice(spacing, centre_row, half_columns, weights, spans)


def surrounding(lattice: Lattice, x: float, y: float) -> list[tuple[int, float]]:
    """The three junctions of the triangle around (x, y), as (flat index, share); the shares add up to 1.

    For pickups: what they hear changes continuously with their place. Points outside are drawn in to the rim.
    """
    x, y = drawn_in(x, y, 1.0 - lattice.spacing)
    b = y / (_ROW_HEIGHT * lattice.spacing)
    a = x / lattice.spacing - 0.5 * b  # oblique coordinates along 0 and 60 degrees
    a0, b0 = math.floor(a), math.floor(b)
    fa, fb = a - a0, b - b0
    if fa + fb <= 1.0:
        corners = [(a0, b0, 1.0 - fa - fb), (a0 + 1, b0, fa), (a0, b0 + 1, fb)]
    else:
        corners = [(a0 + 1, b0 + 1, fa + fb - 1.0), (a0 + 1, b0, 1.0 - fb), (a0, b0 + 1, 1.0 - fa)]
    stride = lattice.weights.shape[1]
    found: list[tuple[int, float]] = []
    for oblique, up, share in corners:
        row = lattice.centre_row + up
        column = lattice.centre_column + oblique + (up >> 1)
        found.append((row * stride + column, share))
    return found


def drawn_in(x: float, y: float, limit: float) -> tuple[float, float]:
    """(x, y), or the nearest point to it at the distance `limit` from the centre when it lies farther out."""
    distance = math.hypot(x, y)
    if distance <= limit:
        return x, y
    return x * limit / distance, y * limit / distance
