"""A head without losses that rings for ever, in float32."""

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.drum.build import size_of
from membranes import Membrane, energy
from realtime.kernels.jit import njit
from stability.catalogue import shows
from stability.mesh_steps import drum_of, engine_of, strike, take

Floats = npt.NDArray[np.float32]
STEPS, NAIVE_STEPS = 100_000_000, 500_000
ALIKE, OWN_FIRST, OWN_LAST = 0, 1, 2


@njit()
def _as_written(
    time_levels: Floats, weights: Floats, stride: int, centre_row: int, tau: float, form: int
) -> None:
    # Two steps as textbooks write them, all in float32; the rounding of each sum is where they differ.
    two, t, own = np.float32(2.0), np.float32(tau), np.float32(2.0 - tau)
    for back in range(2):
        u, u_old = time_levels[back], time_levels[1 - back]
        for i in range(stride + 1, len(u) - stride - 1):
            if weights[i] > 0.0:
                odd = (i // stride - centre_row) & 1
                neighbour_sum = u[i - 1] + u[i + 1] + u[i - stride - 1 + odd] + u[i - stride + odd]
                neighbour_sum += u[i + stride - 1 + odd] + u[i + stride + odd]
                if form == ALIKE:
                    u_old[i] = (two * u[i] - u_old[i]) + t * (weights[i] * neighbour_sum - u[i])
                elif form == OWN_FIRST:
                    u_old[i] = (own * u[i] - u_old[i]) + t * weights[i] * neighbour_sum
                else:
                    u_old[i] = (t * weights[i] * neighbour_sum + own * u[i]) - u_old[i]


@njit()
def _many_as_written(
    time_levels: Floats, weights: Floats, stride: int, centre_row: int, tau: float, form: int, steps: int
) -> None:
    for _ in range(steps // 2):
        _as_written(time_levels, weights, stride, centre_row, tau, form)


@shows("hundred million steps")
@pytest.mark.long
def test_a_hundred_million_steps_keep_their_energy_in_float32() -> None:
    """199 junctions, 2e10 junction updates. The textbook's sums, in any order, gain or lose in half a million steps."""
    engine = engine_of(drum_of({}, f01_Hz=2000.0, mesh={"rate_Hz": 48_000.0}))
    assert size_of(engine) == 199
    strike(engine, 1.0)
    take(engine, 20)
    first, tau = energy(engine), float(engine.control["tau"][0])
    membrane, grid = Membrane(engine.head, float(engine.control["own_gain"][0])), engine.head.grid[0]
    changes: list[float] = []
    for form in (ALIKE, OWN_FIRST, OWN_LAST):
        at = int(engine.control["present_level"][0])
        time_levels = engine.head.time_levels[[at, 1 - at]].copy()
        before = membrane.energy(time_levels[0], time_levels[1], tau)
        weights = membrane.weights.astype(np.float32)
        stride, centre_row = int(grid["stride"]), int(grid["centre_row"])
        _many_as_written(time_levels, weights, stride, centre_row, tau, form, NAIVE_STEPS)
        changes.append(membrane.energy(time_levels[0], time_levels[1], tau) / before - 1.0)
    assert changes[ALIKE] < -3e-4
    assert changes[OWN_FIRST] > 3e-3
    assert changes[OWN_LAST] > 5e-4
    for _ in range(10):
        take(engine, STEPS // 10)
        assert energy(engine) == pytest.approx(first, rel=1e-3)
    assert not engine.head.time_levels[:, engine.head.weights == 0.0].any()
