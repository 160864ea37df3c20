"""The triangular mesh with nothing beside it, for benchmarks: some junctions across, losses of a drum, noise on it."""

import time
from collections.abc import Callable

import numpy as np

from drumstick.drum.membrane.heads import head_of
from drumstick.drum.membrane.lattice import TOPOLOGIES, lattice_of
from drumstick.drum.membrane.scheme import even_losses, scheme_of
from drumstick.drum.membrane.sweep import Head, bare, sweep, sweep_strips
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit

RATE_HZ = 48_000
WAVE, _STRIPS = 8, 2


@njit()
def _sweeps(head: Head, u_gain: np.float32, u_old_gain: np.float32, steps: int) -> None:
    mode = flush_denormals()
    one, other = head.time_levels[0], head.time_levels[1]
    for _ in range(steps):
        sweep(head, one, other, bare(u_gain, u_old_gain))
        one, other = other, one
    restore(mode)


@njit()
def _in_waves(head: Head, u_gain: np.float32, u_old_gain: np.float32, steps: int) -> None:
    # WAVE steps in one pass: some strips are taken a step on as soon as those after them have come that far.
    mode = flush_denormals()
    terms, strips = bare(u_gain, u_old_gain), head.strips.shape[0]
    parts = -(-strips // _STRIPS)
    one, other = head.time_levels[0], head.time_levels[1]
    for _ in range(steps // WAVE):
        for front in range(parts + WAVE - 1):
            for step in range(max(0, front - parts + 1), min(WAVE, front + 1)):
                first = _STRIPS * (front - step)
                u, u_old = (one, other) if step % 2 == 0 else (other, one)
                sweep_strips(head, u, u_old, terms, first, min(first + _STRIPS, strips))
    restore(mode)


def timed(call: Callable[[], object]) -> float:
    """CPU seconds of this thread."""
    begun = time.thread_time()
    call()
    return time.thread_time() - begun


def start(head: Head) -> None:
    """Noise of 1e-3 on the junctions, always the same."""
    inside = head.weights > 0.0
    for u, seed in zip(head.time_levels, (1, 2), strict=True):
        u[:] = 0.0
        u[inside] = np.random.default_rng(seed).standard_normal(int(inside.sum())) * 1e-3


class BareMesh:
    """A head of `across` junctions across at the limit of stability, as a scene without effects has it."""

    def __init__(self, across: float) -> None:
        self.lattice = lattice_of(2.0 / across)
        scheme, losses = scheme_of(TOPOLOGIES["triangular"], 2, False), even_losses(2.0, 1.0 / RATE_HZ)
        self.head = head_of(self.lattice, scheme.tau / (1.0 + losses.s))
        self.u_gain = np.float32((2.0 - scheme.tau) / (1.0 + losses.s))
        self.u_old_gain = np.float32((1.0 - losses.s) / (1.0 + losses.s))
        start(self.head)

    def run_in_waves(self, steps: int) -> None:
        """A multiple of WAVE steps, WAVE of them in each pass over the mesh."""
        _in_waves(self.head, self.u_gain, self.u_old_gain, steps)

    def run(self, steps: int) -> None:
        """An even number of steps: the time levels change places in each."""
        _sweeps(self.head, self.u_gain, self.u_old_gain, steps)
