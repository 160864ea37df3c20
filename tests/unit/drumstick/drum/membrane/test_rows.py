"""The row kernel at every width of vectors: the same bits, and what float64 says."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.membrane.heads import aligned, head_of
from drumstick.drum.membrane.lattice import TOPOLOGIES, lattice_of
from drumstick.drum.membrane.rows import step_of
from drumstick.drum.membrane.simd import WIDTH, widest
from drumstick.drum.membrane.strip import LEFT
from drumstick.drum.membrane.sweep import Head, bare, stretched, sweep
from drumstick.drum.membrane.terms import StripBounds, Terms
from membranes import Membrane
from realtime.kernels.jit import njit

Floats = npt.NDArray[np.float32]
U_GAIN, U_OLD_GAIN = np.float32(-0.6), np.float32(0.98)


def plain_sweep(width: int) -> Any:
    step = step_of(width, LEFT)

    @njit()
    def run(head: Head, u: Floats, u_old: Floats) -> float:
        stride, strips = head.grid[0].stride, head.strips
        total = 0.0
        for at in range(strips.shape[0]):
            bounds = StripBounds(stride, strips[at, 0], strips[at, 1], strips[at, 2], strips[at, 3])
            total += step(u, u_old, head.weights, bounds, bare(U_GAIN, U_OLD_GAIN))
        return total

    return run


def filled(head: Head) -> Head:
    inside = head.weights > 0.0
    for u, seed in zip(head.time_levels, (1, 2), strict=True):
        u[inside] = np.random.default_rng(seed).standard_normal(int(inside.sum()))
    return head


@pytest.mark.daily("23.7")
@pytest.mark.parametrize("across", [5.0, 23.7, 64.2])
def test_every_width_gives_the_same_bits(across: float) -> None:
    lattice = lattice_of(2.0 / across)
    found: set[bytes] = set()
    for width in (1, 4, 8, 16):
        head = filled(head_of(lattice, 2.6))
        assert plain_sweep(width)(head, head.time_levels[0], head.time_levels[1]) == 0.0
        found.add(head.time_levels.tobytes())
    assert len(found) == 1


@pytest.mark.parametrize("kind", TOPOLOGIES)
def test_a_step_is_what_the_equation_says(kind: str) -> None:
    """With everything on: neighbour_gain, push, momentum, and the sum of u+."""
    head = filled(head_of(lattice_of(2.0 / 23.7, TOPOLOGIES[kind]), 2.6))
    membrane = Membrane(head, 2.6)
    u, momentum = head.time_levels[0].copy(), aligned(head.weights.shape)
    momentum[:] = head.time_levels[1] * 0.01
    pulled = 2.6 * membrane.laplacian(u)
    moving = 0.99 * momentum.astype(float) + 1.3 * pulled + 2.6 * membrane.weights * 0.25
    wanted = np.where(membrane.weights > 0.0, u + moving + 0.02 * pulled, 0.0)
    terms = Terms(
        u_gain=np.float32(2.6),
        u_old_gain=U_OLD_GAIN,
        neighbour_gain=np.float32(1.3),
        push=np.float32(0.25),
        momentum=momentum,
        rho=np.float32(0.99),
        eta=np.float32(0.02),
        extra=None,
        extra_gain=None,
        total=1,
    )
    total = sweep(head, head.time_levels[0], head.time_levels[1], terms)
    np.testing.assert_allclose(head.time_levels[1], wanted, atol=2e-5)
    assert total == pytest.approx(float(np.sum(wanted)), abs=1e-2)


def fourth(membrane: Membrane, u: Floats, laplacian: Floats, momentum: Floats | None) -> Terms:
    """Terms of a second sweep, over A u; the sweep's own u is the first."""
    laplacian[:] = membrane.laplacian(u)
    dull = momentum is not None
    return Terms(
        u_gain=np.float32(2.2),
        u_old_gain=U_OLD_GAIN,
        neighbour_gain=np.float32(-0.1),
        push=np.float32(0.25),
        momentum=momentum,
        rho=np.float32(0.99) if dull else None,
        eta=np.float32(0.02) if dull else None,
        extra=u,
        extra_gain=np.float32(0.3) if dull else np.float32(1.9),
        total=1,
    )


@pytest.mark.parametrize("dull", [False, True])
def test_the_second_sweep_is_what_the_equation_says(dull: bool) -> None:
    head = filled(head_of(lattice_of(2.0 / 23.7), 1.0))
    membrane = Membrane(head, 1.0)
    u, before = head.time_levels.copy()
    laplacian, momentum = aligned(head.weights.shape), aligned(head.weights.shape)
    momentum[:] = before * 0.01
    carried = momentum.astype(float)
    terms = fourth(membrane, head.time_levels[0], laplacian, momentum if dull else None)
    # u_gain A u and what A A u has of it: w sum = A A u + A u.
    pulled = 2.2 * laplacian - 0.1 * (membrane.laplacian(laplacian) + laplacian)
    push = 0.25 * membrane.weights
    if dull:
        moving = 0.99 * carried + pulled + 0.3 * laplacian + push
        wanted = u + moving + 0.02 * pulled
    else:
        wanted = pulled + push + 1.9 * u - float(U_OLD_GAIN) * before
    wanted = np.where(membrane.weights > 0.0, wanted, 0.0)
    total = sweep(head, laplacian, head.time_levels[1], terms)
    np.testing.assert_allclose(head.time_levels[1], wanted, atol=2e-5)
    assert total == pytest.approx(float(np.sum(wanted)), abs=1e-2)


@pytest.mark.parametrize("kind", TOPOLOGIES)
def test_the_stretch_is_what_its_sums_say(kind: str) -> None:
    head = filled(head_of(lattice_of(2.0 / 23.7, TOPOLOGIES[kind]), 2.6))
    membrane = Membrane(head, 2.6)
    share = aligned(head.weights.shape)
    share[:] = membrane.mass
    u, before = head.time_levels[0].astype(float), head.time_levels[1].astype(float)
    d = 2.6 * membrane.laplacian(head.time_levels[0])
    terms = bare(np.float32(2.6), U_OLD_GAIN)
    found = stretched(head, head.time_levels[0], head.time_levels[1], share, terms)
    weights = 2.6 * membrane.weights
    wanted = [np.sum(share * d * other) for other in (u - before, d, weights, before)]
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=0.05)


@pytest.mark.parametrize("dull", [False, True])
def test_the_stretch_of_the_fourth_order_is_what_its_sums_say(dull: bool) -> None:
    head = filled(head_of(lattice_of(2.0 / 23.7), 1.0))
    membrane = Membrane(head, 1.0)
    share, laplacian, momentum = (aligned(head.weights.shape) for _ in range(3))
    share[:], momentum[:] = membrane.mass, head.time_levels[1] * 0.01
    terms = fourth(membrane, head.time_levels[0], laplacian, momentum if dull else None)
    found = stretched(head, laplacian, head.time_levels[1], share, terms)
    u, before = head.time_levels.astype(float)
    d = laplacian.astype(float)
    moved = u - before + 2.2 * d - 0.1 * (membrane.laplacian(laplacian) + d)
    if dull:
        moved += 0.99 * momentum.astype(float)
    wanted = [np.sum(share * d * other) for other in (moved, d, membrane.weights, before)]
    np.testing.assert_allclose(found, wanted, rtol=2e-4, atol=0.05)


def test_the_widest_vectors_of_a_processor() -> None:
    assert widest({"avx512f": True, "avx": True}) == 16
    assert widest({"avx512f": False, "avx": True}) == 8
    assert widest({}) == 4
    assert WIDTH in (4, 8, 16)
