"""The modes of the compiled mesh, by the eigenvalues of the very kernel that plays, against the ideal membrane."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.special import jn_zeros

from drumstick.drum.estimate import rms_cents
from drumstick.drum.membrane.heads import head_of
from drumstick.drum.membrane.lattice import J01, TOPOLOGIES, Lattice
from drumstick.drum.membrane.scheme import Scheme, even_losses, rising_losses, scheme_of, tuned
from drumstick.drum.membrane.sweep import Head, bare, sweep
from realtime.kernels.jit import njit

# The first twenty modes of the ideal membrane: zeros of the Bessel functions J_m, twice for m > 0 (cosine and sine).
_ZEROS = sorted((zero, m) for m in range(12) for zero in jn_zeros(m, 6))[:20]
MODES = [zero for zero, m in _ZEROS for _ in range(1 if m == 0 else 2)]
STEP_S = 1.0 / 48000.0
KINDS = {
    "triangular": scheme_of(TOPOLOGIES["triangular"], 2, False),
    "triangular lossless": scheme_of(TOPOLOGIES["triangular"], 2, True),
    "rectilinear": scheme_of(TOPOLOGIES["rectilinear"], 2, False),
    "fourth order": scheme_of(TOPOLOGIES["triangular"], 4, False),
}


@njit()
def laplacian(head: Head, u: npt.NDArray[np.float32], out: npt.NDArray[np.float32]) -> None:
    """A u, by the sweep."""
    zero = np.float32(0.0)
    sweep(head, u, out, bare(np.float32(-1.0), zero))


def eigenvalues(lattice: Lattice) -> npt.NDArray[np.float64]:
    """The eigenvalues a of A u = -a u, rising: one unit displacement after another goes through the kernel."""
    head = head_of(lattice, 1.0)
    inside = np.flatnonzero(lattice.weights)
    columns = np.zeros((len(inside), len(inside)))
    for k, place in enumerate(inside):
        u, out = head.time_levels
        u[:], out[:] = 0.0, 0.0
        u[place] = 1.0
        laplacian(head, u, out)
        assert not out[lattice.weights.ravel() == 0.0].any()
        columns[:, k] = out[inside]
    root = np.sqrt(lattice.weights.ravel()[inside])
    symmetric = columns * root[None, :] / root[:, None]
    assert np.allclose(symmetric, symmetric.T, atol=1e-5)  # reciprocity of any two junctions
    return np.sort(-np.linalg.eigvalsh(0.5 * (symmetric + symmetric.T)))


def lattice_across(scheme: Scheme, across: float) -> tuple[Lattice, float]:
    """A lattice of about so many junctions across, and the pitch in Hz that it is tuned to."""
    f01_Hz = J01 / math.pi * math.sqrt(scheme.tau) / 2.0 / STEP_S / across
    return tuned(f01_Hz, STEP_S, scheme, even_losses(math.inf, STEP_S)), f01_Hz


def cents_off(scheme: Scheme, across: float, modes: int) -> npt.NDArray[np.float64]:
    """Error of the lowest modes against the Bessel zeros, in cents."""
    lattice, f01_Hz = lattice_across(scheme, across)
    a = eigenvalues(lattice)[:modes]
    q = scheme.tau * a - scheme.order_4 * a * a
    found_Hz = np.arccos(1.0 - q / 2.0) / (2.0 * math.pi * STEP_S)
    return 1200.0 * np.log2(found_Hz / (f01_Hz / J01 * np.array(MODES[:modes])))


@pytest.mark.parametrize(
    ("kind", "across", "rms_cents"),
    [
        ("triangular", 24.0, 8.0),
        ("triangular", 32.0, 4.0),
        ("triangular", 64.0, 1.0),
        ("triangular lossless", 32.0, 8.5),
        ("rectilinear", 32.0, 9.0),
        ("fourth order", 24.0, 4.2),
        ("fourth order", 32.0, 1.6),
    ],
)
@pytest.mark.daily("triangular-24*", "fourth order-24*", "rectilinear*")
def test_first_twenty_modes_are_those_of_the_membrane(kind: str, across: float, rms_cents: float) -> None:
    off = cents_off(KINDS[kind], across, len(MODES))
    assert 0.7 * rms_cents < math.sqrt(np.mean(off**2)) < rms_cents
    assert abs(off[0]) < 0.05


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.daily("*triangular*")
def test_the_radius_is_a_real_number(kind: str) -> None:
    """Without weights at the rim, f01 would jump by up to 70 cents as junctions fall in and out."""
    for across in np.linspace(24.0, 25.0, 6):
        assert abs(cents_off(KINDS[kind], across, 1)[0]) < 0.05


@pytest.mark.parametrize("kind", KINDS)
def test_the_limit_of_stability_is_respected_with_a_rim(kind: str) -> None:
    """0 <= q <= 4, even where the rim passes close to junctions; and the scheme goes near its limit."""
    scheme = KINDS[kind]
    for across in (9.7, 16.0, 21.3):
        a = eigenvalues(lattice_across(scheme, across)[0])
        q = scheme.tau * a - scheme.order_4 * a * a
        assert 0.0 < q.min() <= q.max() <= 4.0 + 1e-5
        assert q.max() > (2.9 if "lossless" in kind else 3.8)


@pytest.mark.parametrize("t60_s", [0.05, 1.2, 20.0])
def test_even_losses_are_exact_at_any_frequency(t60_s: float) -> None:
    losses = even_losses(t60_s, STEP_S)
    for theta in (0.01, 0.3, 2.0):
        assert losses.t60_s(theta, STEP_S) == pytest.approx(t60_s, rel=1e-9)


def test_rising_losses_meet_both_ends_and_the_square_between() -> None:
    losses = rising_losses(1.5, 150.0, 0.2, 3000.0, STEP_S)
    rise = (1.0 / 0.2 - 1.0 / 1.5) / (3000.0**2 - 150.0**2)
    for f_Hz in (150.0, 800.0, 3000.0):
        wanted = 1.0 / (1.0 / 1.5 + rise * (f_Hz**2 - 150.0**2))
        assert losses.t60_s(2.0 * math.pi * f_Hz * STEP_S, STEP_S) == pytest.approx(wanted, rel=0.02)
    with pytest.raises(ValueError, match="must be less than"):
        rising_losses(0.1, 150.0, 0.2, 3000.0, STEP_S)


def test_bessel_zero_of_the_tuning() -> None:
    assert pytest.approx(MODES[0], abs=1e-6) == J01


@pytest.mark.parametrize(
    "scheme", [*KINDS.values(), *(Scheme(TOPOLOGIES["triangular"], tau) for tau in (2.3, 1.2, 0.4))]
)
@pytest.mark.parametrize("across", [24.0, 32.0, 44.0])
@pytest.mark.daily("24.0-*")
def test_the_outlook_tells_the_error_that_the_kernel_has(scheme: Scheme, across: float) -> None:
    """Also where effects leave a wave less room than the textbook's tau = 2."""
    found = math.sqrt(np.mean(cents_off(scheme, across, 20) ** 2))
    assert rms_cents(scheme, across) == pytest.approx(found, rel=0.15)
