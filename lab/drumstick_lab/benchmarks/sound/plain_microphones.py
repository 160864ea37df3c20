"""Microphones above a mesh as plain loops, one for each run of neighbours that arrive in the same step.

What the vector code (drumstick.drum.output.arrivals) is measured against, and must equal.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.engine import Engine
from drumstick.drum.membrane.lattice import Lattice
from drumstick.drum.output.microphones import paths
from drumstick.parameters.scene import Scene
from realtime.kernels.jit import njit

Floats = npt.NDArray[np.float32]


class PlainMicrophones(NamedTuple):
    """M microphones. Shapes: runs (n, 4): microphone, first junction, last + 1, delay in steps; near and far (M, J):
    what a junction gives at its delay and a step later; line (M, a power of 2); at (1,): steps so far."""

    runs: npt.NDArray[np.int64]
    near: Floats
    far: Floats
    line: npt.NDArray[np.float64]
    at: npt.NDArray[np.int64]


@njit(fastmath={"contract", "reassoc"})
def _together(u: Floats, u_new: Floats, near: Floats, far: Floats) -> tuple[float, float]:
    first = second = np.float32(0.0)
    for i in range(u.shape[0]):
        moved = u_new[i] - u[i]
        first += near[i] * moved
        second += far[i] * moved
    return float(first), float(second)


@njit()
def captured(air: PlainMicrophones, u: Floats, u_new: Floats) -> float:
    """Send off what the head's step radiates; returns the sum of what arrives."""
    t, last = air.at[0], air.line.shape[1] - 1
    for k in range(air.runs.shape[0]):
        m, start, stop, delay = air.runs[k]
        sent = _together(u[start:stop], u_new[start:stop], air.near[m, start:stop], air.far[m, start:stop])
        air.line[m, (t + delay) & last] += sent[0]
        air.line[m, (t + delay + 1) & last] += sent[1]
    heard = 0.0
    for m in range(air.line.shape[0]):
        heard += air.line[m, t & last] - air.line[m, (t - 1) & last]
        air.line[m, (t - 1) & last] = 0.0
    air.at[0] = t + 1
    return heard


@njit()
def captured_after(engine: Engine, air: PlainMicrophones) -> float:
    """`captured`, of the step that the engine has just taken."""
    present, levels = engine.control[0].present_level, engine.head.time_levels
    return captured(air, levels[1 - present], levels[present])


def plain_microphones(scene: Scene, lattice: Lattice, step_s: float) -> PlainMicrophones:
    """The scene's, above a head on this lattice."""
    places = np.flatnonzero(lattice.weights.ravel())
    near, far = (
        np.zeros((len(scene.listen.microphones), lattice.weights.size), np.float32) for _ in range(2)
    )
    runs: list[tuple[Any, ...]] = []
    for m, (late, nearness) in enumerate(paths(scene, lattice, step_s)):
        whole = np.floor(late).astype(np.int64)
        near[m], far[m] = nearness * (1.0 - (late - whole)), nearness * (late - whole)
        breaks = np.flatnonzero((np.diff(places) != 1) | (np.diff(whole[places]) != 0)) + 1
        runs += [(m, part[0], part[-1] + 1, whole[part[0]]) for part in np.split(places, breaks)]
    line = np.zeros((len(near), 1 << (int(max(run[3] for run in runs)) + 2).bit_length()))
    return PlainMicrophones(np.array(runs, np.int64), near, far, line, np.ones(1, np.int64))
