"""The mesh as it is computed against the same mesh as travelling waves."""

import numpy as np
import pytest

from drumstick.drum.membrane.heads import head_of
from drumstick.drum.membrane.lattice import TOPOLOGIES, lattice_of
from drumstick.drum.membrane.sweep import Head, bare, sweep
from realtime.kernels.jit import njit
from scattering import Scattering

STEPS = 400


@njit()
def take_step(head: Head, at: int, u_gain: np.float32, u_old_gain: np.float32) -> None:
    sweep(head, head.time_levels[at], head.time_levels[1 - at], bare(u_gain, u_old_gain))


@pytest.mark.parametrize(
    ("topology", "tau"),
    [("triangular", 2.0), ("triangular", 8.0 / 3.0), ("rectilinear", 2.0), ("rectilinear", 1.5)],
)
@pytest.mark.daily("rectilinear-2.0")
def test_the_mesh_is_a_mesh_of_waveguides(topology: str, tau: float) -> None:
    """Every junction, after hundreds of reflections at the rim: the same to what float32 leaves."""
    lattice = lattice_of(2.0 / 17.3, TOPOLOGIES[topology])
    head, waves = head_of(lattice, tau), Scattering(lattice, tau)
    row, column = lattice.centre_row + 3, lattice.centre_column - 2
    # What comes from outside goes out by all ports and would return to its junction two steps later, where the mesh of
    # displacements holds it: there it acts as its difference over two steps.
    head.time_levels[0].reshape(lattice.weights.shape)[row, column] = 1.0
    waves.push(row, column, 1.0)
    most, at = 0.0, 0
    for step in range(1, STEPS + 1):
        take_step(head, at, np.float32(2.0 - tau), np.float32(1.0))
        at = 1 - at
        found = head.time_levels[at].reshape(lattice.weights.shape)
        if step == 2:
            found[row, column] -= 1.0
        expected = waves.step()
        most = max(most, float(np.abs(expected).max()))
        assert found == pytest.approx(expected, abs=2e-5)
    assert most > 0.3
