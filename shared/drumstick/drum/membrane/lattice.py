"""Places of a mesh's junctions, and the rim's weight on them.

Triangular rows are stored as in a brick wall: odd rows (counted from the centre's row) are shifted by half a spacing;
square rows lie straight. Around every row is room that stays exactly 0, and rows are whole numbers of 16 lanes, so the
sweep needs neither a mask nor a remainder loop; it takes some rows at once, a strip, and there are spare rows to fill
the last strip. Lengths here are in radii of the head; its centre is a junction.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

MESH_LANES = 16  # one 64-byte cache line of float32
STRIP_ROWS = 4  # of a strip; even, so that all strips begin with a row that is not shifted
MARGIN = 2  # empty rows above and below: one is a neighbour, a vector of the other lies beside it in memory
J01 = 2.404825557695773  # first zero of the Bessel function J0
_RIM = 1.0 - 1e-9  # squared: a junction on the rim itself would have an infinite admittance


@dataclass(frozen=True)
class Topology:
    """Neighbours of a junction.

    neighbours: in directions that divide the circle evenly, from 0 on. row_height: between rows, in spacings.
    max_eigenvalue: largest eigenvalue of u - mean of the neighbours.
    """

    neighbours: int
    row_height: float
    max_eigenvalue: float

    @property
    def shifted(self) -> bool:
        """Do odd rows lie half a spacing to the right?"""
        return self.neighbours == 6


TOPOLOGIES = {
    "triangular": Topology(6, math.sqrt(3.0) / 2.0, 1.5),
    "rectilinear": Topology(4, 1.0, 2.0),
}


@dataclass(frozen=True)
class Lattice:
    """Junctions of a clamped circular head.

    `weights` (float64) and everything that is stored per junction have shape (rows, stride); `spans` (int32) has
    shape (rows, 2): first column and number of columns of the padded row, both multiples of 16. The first two and last
    two rows are empty, and between them is a multiple of STRIP_ROWS, the first of them not shifted. `spacing` is
    h / radius. A junction far from the rim weighs 1 / neighbours.
    """

    topology: Topology
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

    @property
    def area(self) -> float:
        """The head's area in junctions: what as many junctions far from the rim would cover."""
        return math.pi / (self.topology.row_height * self.spacing**2)

    def shift(self, row: int) -> float:
        """Offset of a row's junctions to the right, in spacings."""
        return 0.5 * ((row - self.centre_row) & 1) if self.topology.shifted else 0.0

    def position(self, row: int, column: int) -> tuple[float, float]:
        """x, y of a junction in radii."""
        x = (column - self.centre_column + self.shift(row)) * self.spacing
        return x, (row - self.centre_row) * self.topology.row_height * self.spacing


def _rim_weights(
    x: npt.NDArray[np.float64], y: npt.NDArray[np.float64], h: float, neighbours: int
) -> npt.NDArray[np.float64]:
    # w = 1 / (neighbours inside + sum over cut edges of 1/theta), theta = distance to the circle along the edge / h:
    # the junction equation with admittance 1/theta on the cut edges. It makes the radius a real number.
    inside = x * x + y * y < _RIM
    admittance = np.zeros_like(x)
    for k in range(neighbours):
        angle = 2.0 * math.pi * k / neighbours
        dx, dy = h * math.cos(angle), h * math.sin(angle)
        cut = inside & ((x + dx) ** 2 + (y + dy) ** 2 >= _RIM)
        # |p + theta d| = 1 for the direction d of length h
        along = x * dx + y * dy
        room = np.where(cut, along**2 + h * h * (1.0 - x * x - y * y), 1.0)
        theta = np.where(cut, (np.sqrt(room) - along) / (h * h), 1.0)
        admittance += 1.0 / theta
    return np.where(inside, 1.0 / admittance, 0.0)


def lattice_of(spacing: float, topology: Topology = TOPOLOGIES["triangular"]) -> Lattice:
    """Lay junctions `spacing` radii apart. ValueError for fewer than about 4 across: that is no drum any more."""
    if not 1e-3 <= spacing <= 0.5:
        raise ValueError(f"junctions {spacing:g} radii apart: the mesh takes 0.001 .. 0.5")
    half_rows = math.floor(1.0 / (topology.row_height * spacing))
    centre_row = MARGIN + half_rows + half_rows % 2
    rows = 2 * MARGIN + -(-(centre_row + half_rows + 1 - MARGIN) // STRIP_ROWS) * STRIP_ROWS
    centre_column = _best_column(topology, spacing, half_rows)
    # The last lane of a row is never inside: it is the left neighbour of the next row's first lane.
    stride = (centre_column + math.floor(1.0 / spacing) + 1 + MESH_LANES) // MESH_LANES * MESH_LANES
    weights = np.zeros((rows, stride))
    spans = np.zeros((rows, 2), np.int32)
    row = np.arange(-half_rows, half_rows + 1)[:, None]
    shift = 0.5 * (row & 1) if topology.shifted else 0.0 * row
    x = (np.arange(stride, dtype=np.float64) - centre_column + shift) * spacing
    y = (row * topology.row_height * spacing).astype(np.float64)
    found = _rim_weights(x, y, spacing, topology.neighbours)
    weights[centre_row + row[:, 0]] = found
    inside = found != 0.0
    first = inside.argmax(axis=1) // MESH_LANES * MESH_LANES
    last = stride - 1 - inside[:, ::-1].argmax(axis=1)
    whole = np.column_stack([first, (last + MESH_LANES) // MESH_LANES * MESH_LANES - first])
    spans[centre_row + row[:, 0]] = np.where(inside.any(axis=1)[:, None], whole, 0)
    return Lattice(topology, spacing, centre_row, centre_column, weights, spans)


def _best_column(topology: Topology, spacing: float, half_rows: int) -> int:
    # Where the centre is to lie between the borders of vectors, so that rows are the fewest vectors together.
    row = np.arange(-half_rows, half_rows + 1)
    shift = 0.5 * (row & 1) if topology.shifted else 0.0 * row
    half = np.sqrt(np.maximum(1.0 - (row * topology.row_height * spacing) ** 2, 0.0)) / spacing
    first, last = np.ceil(-half - shift), np.floor(half - shift)
    least = math.floor(1.0 / spacing) + 1
    columns = np.arange(least, least + MESH_LANES)[:, None]
    vectors = (columns + last) // MESH_LANES - (columns + first) // MESH_LANES + 1
    return least + int(np.argmin(np.sum(vectors, axis=1)))


def strips_of(lattice: Lattice) -> npt.NDArray[np.int64]:
    """The mesh in strips of STRIP_ROWS rows: int64, shape (strips, 4).

    Flat indices in a strip's first row, multiples of 16: start, inner, outer, stop. Beyond start .. stop its rows are
    empty; from inner to outer, if they differ, all junctions of all its rows weigh the same: 1 / neighbours.
    """
    stride = lattice.weights.shape[1]
    even = lattice.weights == 1.0 / lattice.topology.neighbours
    found: list[tuple[int, ...]] = []
    for row in range(MARGIN, len(lattice.spans) - MARGIN, STRIP_ROWS):
        spans = lattice.spans[row : row + STRIP_ROWS]
        taken = spans[spans[:, 1] > 0]
        if not len(taken):
            continue
        start, stop = int(taken[:, 0].min()), int(taken.sum(axis=1).max())
        whole = np.flatnonzero(even[row : row + STRIP_ROWS].all(axis=0).reshape(-1, MESH_LANES).all(axis=1))
        inner, outer = (MESH_LANES * whole[0], MESH_LANES * (whole[-1] + 1)) if len(whole) else (start, start)
        found.append(tuple(row * stride + int(column) for column in (start, inner, outer, stop)))
    return np.array(found, np.int64)


def _ring(lattice: Lattice, u: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    # Sum over each junction's neighbours of u, shape (rows, stride).
    found = np.roll(u, 1, 1) + np.roll(u, -1, 1)
    if not lattice.topology.shifted:
        return found + np.roll(u, 1, 0) + np.roll(u, -1, 0)
    odd = np.array([(row - lattice.centre_row) % 2 == 1 for row in range(u.shape[0])])[:, None]
    for beside in (np.roll(u, 1, 0), np.roll(u, -1, 0)):
        found += beside + np.where(odd, np.roll(beside, -1, 1), np.roll(beside, 1, 1))
    return found


def lowest_eigenvalue(lattice: Lattice) -> float:
    """The smallest a with A u = -a u, that of the lowest mode.

    The Rayleigh quotient of the ideal membrane's mode, whose own error it squares: true to 1e-6 from 24 across.
    """
    rows, columns = np.nonzero(lattice.weights)
    u = np.zeros_like(lattice.weights)
    shift = 0.5 * ((rows - lattice.centre_row) & 1) if lattice.topology.shifted else 0.0
    x = (columns - lattice.centre_column + shift) * lattice.spacing
    y = (rows - lattice.centre_row) * lattice.topology.row_height * lattice.spacing
    squared = J01**2 * (x * x + y * y) / 4.0
    term = np.ones_like(squared)
    total = term.copy()
    for k in range(1, 16):  # J0 by its series
        term *= -squared / k**2
        total += term
    u[rows, columns] = total
    mass = 1.0 / lattice.weights[rows, columns]
    norm = float(np.sum(mass * total * total))
    return (norm - float(np.sum(total * _ring(lattice, u)[rows, columns]))) / norm
