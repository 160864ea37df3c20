"""A small head as a matrix, in float64, for naive methods: tried on the same lattice as ours, in a few lines."""

import math

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.heads import head_of
from drumstick.drum.membrane.lattice import TOPOLOGIES, lattice_of
from membranes import Membrane

Plane = npt.NDArray[np.float64]


class DenseMesh:
    """`laplacian` is A, with A u = (mean of the neighbours, weighted at the rim) - u.

    `mass`, `x` and `y` are per junction.
    """

    def __init__(self, across: float = 12.3, topology: str = "triangular") -> None:
        lattice = lattice_of(2.0 / across, TOPOLOGIES[topology])
        self.lattice = lattice
        self._membrane = Membrane(head_of(lattice, 1.0), 1.0)
        self._inside = np.flatnonzero(lattice.weights)
        rows, columns = np.nonzero(lattice.weights)
        places = [lattice.position(int(r), int(c)) for r, c in zip(rows, columns, strict=True)]
        self.x, self.y = np.array(places).T
        self.weights = lattice.weights.ravel()[self._inside]
        self.mass = self._membrane.mass[self._inside]
        self.laplacian: Plane = np.column_stack([self._column(at) for at in self._inside])

    def _column(self, at: int) -> Plane:
        unit = np.zeros(self.lattice.weights.size)
        unit[at] = 1.0
        return self._membrane.laplacian(unit)[self._inside]

    def bump(self) -> Plane:
        """A smooth displacement off the centre, 1 at its top."""
        return np.exp(-((self.x - 0.3) ** 2 + (self.y - 0.2) ** 2) / 0.1)

    def stretch(self, u: Plane, v: Plane) -> float:
        """<u, L v>."""
        return -float(np.sum(self.mass * u * (self.laplacian @ v)))

    def energy(self, u: Plane, before: Plane, tau: float) -> float:
        """Energy of a head without losses, as membranes.Membrane has it."""
        moved = u - before
        return 0.5 * float(np.sum(self.mass * moved * moved)) + 0.5 * tau * self.stretch(u, before)


def grown(energies: list[float]) -> float:
    """Ratio of the largest to the first; inf as soon as one is no number."""
    return max(energies) / energies[0] if all(map(math.isfinite, energies)) else math.inf
