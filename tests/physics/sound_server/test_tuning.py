"""The modes of the compiled mesh, by the eigenvalues of the very kernel that plays, against the ideal membrane."""

import math

import numpy as np
import numpy.typing as npt
import pytest

from sound_server.lattice import J01, Lattice, lattice_of
from sound_server.mesh import TAU, sweep

# Zeros j_mn of the Bessel functions (Abramowitz and Stegun, table 9.5), each as often as its mode occurs:
# once for m = 0, else twice (cosine and sine).
MODES = sorted(
    [2.404826, 5.520078, 8.653728]
    + 2
    * [3.831706, 7.015587, 10.173468, 5.135622, 8.417244, 6.380162, 9.761023, 7.588342, 8.771484, 9.936110]
)[:20]


def operator(lattice: Lattice) -> npt.NDArray[np.float64]:
    """The sweep as a symmetric matrix: one unit displacement after another goes through it."""
    flat = lattice.weights.ravel()
    inside = np.flatnonzero(flat)
    weights = (TAU * flat).astype(np.float32)
    columns = np.zeros((len(inside), len(inside)))
    for k, place in enumerate(inside):
        now, then = np.zeros_like(weights), np.zeros_like(weights)
        now[place] = 1.0
        sweep(now, then, weights, lattice.spans, lattice.centre_row, np.float32(2.0 - TAU), np.float32(1.0))
        columns[:, k] = then[inside]
    root = np.sqrt(flat[inside])
    symmetric = columns * root[None, :] / root[:, None]
    assert np.allclose(symmetric, symmetric.T, atol=1e-5)  # float32 weights; reciprocity of any two junctions
    return 0.5 * (symmetric + symmetric.T)


def cents_off(lattice: Lattice, modes: int) -> npt.NDArray[np.float64]:
    """Error of the lowest modes, with the speed of waves that `spacing_for` assumes."""
    top = np.linalg.eigvalsh(operator(lattice))[::-1][:modes]
    angle = np.arccos(top / 2.0)  # per step: u+ + u- = 2 cos(angle) u
    speed = math.sqrt(TAU / 4.0) * lattice.spacing  # lambda h, radii per step
    return 1200.0 * np.log2(angle / (speed * np.array(MODES[:modes])))


@pytest.mark.parametrize(("across", "rms_cents"), [(24.0, 6.0), (32.0, 3.0)])
def test_first_twenty_modes_are_those_of_the_membrane(across: float, rms_cents: float) -> None:
    off = cents_off(lattice_of(2.0 / across), 20)
    assert abs(off[0]) < 0.5
    assert math.sqrt(np.mean(off**2)) < rms_cents


def test_the_radius_is_a_real_number() -> None:
    """Without weights at the rim, f01 would jump by up to 70 cents as junctions fall in and out."""
    for across in np.linspace(20.0, 21.0, 6):
        assert abs(cents_off(lattice_of(2.0 / across), 1)[0]) < 1.0


def test_the_limit_of_stability_is_respected_with_a_rim() -> None:
    """-2 <= eigenvalue <= 2 of u+ + u- = L u, even where the rim passes close to junctions."""
    for across in (9.7, 16.0, 21.3):
        values = np.linalg.eigvalsh(operator(lattice_of(2.0 / across)))
        assert -2.0 - 1e-5 <= values[0] <= values[-1] <= 2.0


def test_bessel_zero_of_the_tuning() -> None:
    assert pytest.approx(MODES[0], abs=1e-6) == J01
