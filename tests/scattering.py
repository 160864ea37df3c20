"""The same membrane as scattering junctions and travelling waves (W form), float64: an oracle for the mesh's own form.

At a junction of admittances Y_i, p-_i = v - p+_i with v = 2 sum Y_i p+_i / sum Y_i (Smith, "Physical Audio Signal
Processing", "The Digital Waveguide Mesh"). A way to a neighbour has Y = 1 and a delay of one step; a way that the rim
cuts at the part theta has Y = 1/theta and ends in a junction that never moves; a port that leads back to its own
junction, Y = (2 - tau)/(tau w), stands for what a step leaves of u itself.
"""

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import Lattice

Plane = npt.NDArray[np.float64]


def _ways(lattice: Lattice, row: int) -> list[tuple[int, int]]:
    # (rows, columns) to each neighbour, opposite ways three (or two) apart.
    if not lattice.topology.shifted:
        return [(0, 1), (1, 0), (0, -1), (-1, 0)]
    odd = (row - lattice.centre_row) & 1
    return [(0, 1), (1, odd), (1, odd - 1), (0, -1), (-1, odd - 1), (-1, odd)]


class Scattering:
    """Waves on a lattice at rest; `push` moves a junction, `step` takes one step and returns v, (rows, stride)."""

    def __init__(self, lattice: Lattice, tau: float) -> None:
        self._inside = lattice.weights > 0.0
        self._rows, self._columns = np.nonzero(self._inside)
        ports = lattice.topology.neighbours
        self._opposite = [(k + ports // 2) % ports for k in range(ports)]
        shape = (ports, *lattice.weights.shape)
        self._to = np.zeros((ports, 2, *lattice.weights.shape), np.int64)
        open_ways = np.zeros(shape, bool)
        for row, column in zip(self._rows, self._columns, strict=True):
            for k, (down, along) in enumerate(_ways(lattice, int(row))):
                self._to[k, :, row, column] = row + down, column + along
                open_ways[k, row, column] = self._inside[row + down, column + along]
        whole = np.zeros_like(lattice.weights)
        whole[self._inside] = 1.0 / lattice.weights[self._inside]
        cut = whole - open_ways.sum(axis=0)  # the admittance of all cut ways together
        own = (2.0 - tau) / tau * whole
        self._open = open_ways
        self._y = np.concatenate([open_ways.astype(float), cut[None], own[None]])
        self._come = np.zeros((ports + 2, *lattice.weights.shape))  # p+ at each port
        self._on_the_way = np.zeros_like(lattice.weights)  # to the rim and back: a delay of two
        self.v = np.zeros_like(lattice.weights)
        self._scatter()

    def _scatter(self) -> None:
        total = np.where(self._inside, self._y.sum(axis=0), 1.0)
        self.v = np.where(self._inside, 2.0 * (self._y * self._come).sum(axis=0) / total, 0.0)

    def step(self) -> Plane:
        """The waves travel, then scatter."""
        go = self.v - self._come
        come = np.zeros_like(self._come)
        for k, back in enumerate(self._opposite):
            rows, columns = (self._to[k, axis][self._open[k]] for axis in (0, 1))
            come[back][rows, columns] = go[k][self._open[k]]
        ports = len(self._opposite)
        come[ports] = -self._on_the_way
        self._on_the_way = go[ports]
        come[ports + 1] = go[ports + 1]
        self._come = come
        self._scatter()
        return self.v

    def push(self, row: int, column: int, step: float) -> None:
        """Move one junction by `step` now: a force from outside, which all of its ports carry away."""
        self.v[row, column] += step
