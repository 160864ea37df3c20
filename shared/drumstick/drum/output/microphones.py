"""Microphones in the air above the head: every junction is heard after its distance, and the weaker the farther.

The head in an infinite baffle radiates p(t) = rho/(2 pi) sum of A_j a_j(t - r_j/c)/r_j, with a_j each junction's
acceleration, A_j its area and r_j its distance (Rayleigh's integral). Each junction's velocity goes into a line of the
sounds that are on their way, shared by its nearness between two steps; what comes out is the line's change. Junctions
that lie side by side in a row and arrive in the same step form a run, which is one loop. Kernels: audio thread.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.membrane.lattice import Lattice
from drumstick.drum.memory.microphones import Microphones
from drumstick.parameters.scene import Scene
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]


@njit(fastmath={"contract", "reassoc"})
def _together(u: Floats, u_new: Floats, near: Floats, far: Floats) -> tuple[float, float]:
    first = second = np.float32(0.0)
    for i in range(u.shape[0]):
        moved = u_new[i] - u[i]
        first += near[i] * moved
        second += far[i] * moved
    return float(first), float(second)


@only_with("microphones", otherwise=(0.0, 0.0))
def captured(engine: "Engine", u: Floats, u_new: Floats) -> Any:
    """Send off what the head's step radiates; returns what arrives, left and right."""
    air = engine.microphones
    t, last = air.at[0], air.line.shape[1] - 1
    for k in range(air.runs.shape[0]):
        m, start, stop, delay = air.runs[k]
        sent = _together(u[start:stop], u_new[start:stop], air.near[m, start:stop], air.far[m, start:stop])
        air.line[m, (t + delay) & last] += sent[0]
        air.line[m, (t + delay + 1) & last] += sent[1]
    left, right = 0.0, 0.0
    for m in range(air.line.shape[0]):
        change = air.line[m, t & last] - air.line[m, (t - 1) & last]
        air.line[m, (t - 1) & last] = 0.0  # free for what will arrive once the line has come round
        left += air.gains[m, 0] * change
        right += air.gains[m, 1] * change
    air.at[0] = t + 1
    return left, right


@only_with("microphones")
def reset(engine: "Engine") -> None:
    """Empty the delay lines."""
    engine.microphones.line[:] = 0.0


def _runs(delays: npt.NDArray[np.int64], inside: npt.NDArray[np.bool_], m: int) -> list[tuple[int, ...]]:
    # Of one microphone: neighbours in memory, inside the head, of one delay.
    places = np.flatnonzero(inside)
    breaks = np.flatnonzero((np.diff(places) != 1) | (np.diff(delays[places]) != 0)) + 1
    return [(m, int(part[0]), int(part[-1]) + 1, int(delays[part[0]])) for part in np.split(places, breaks)]


def microphones_of(scene: Scene, lattice: Lattice, step_s: float) -> Microphones:
    """The scene's, above a head on this lattice. Allocates; any thread."""
    rows, columns = lattice.weights.shape
    inside = (lattice.weights > 0.0).ravel()
    row, column = (axis.ravel() for axis in np.indices((rows, columns)))
    shift = 0.5 * ((row - lattice.centre_row) & 1) if lattice.topology.shifted else 0.0
    x = (column - lattice.centre_column + shift) * lattice.spacing
    y = (row - lattice.centre_row) * lattice.topology.row_height * lattice.spacing
    area = np.zeros(inside.size)
    area[inside] = 1.0 / (lattice.topology.neighbours * lattice.weights.ravel()[inside])
    wanted = scene.listen.microphones
    near, far = (np.zeros((len(wanted), inside.size), np.float32) for _ in range(2))
    gains = np.zeros((len(wanted), 2))
    runs: list[tuple[int, ...]] = []
    for m, (at_x, at_y, at_z, pan) in enumerate(wanted):
        distance = np.sqrt((x - at_x) ** 2 + (y - at_y) ** 2 + at_z**2)
        late = distance * scene.drum.radius_m / SOUND_M_PER_S / step_s
        whole = np.floor(late).astype(np.int64)
        near[m] = area / distance * (1.0 - (late - whole))
        far[m] = area / distance * (late - whole)
        runs += _runs(whole, inside, m)
        angle = (pan + 1.0) * math.pi / 4.0  # equal power
        gains[m] = math.cos(angle), math.sin(angle)
    longest = max(run[3] for run in runs) + 3
    line = np.zeros((len(wanted), 1 << (longest - 1).bit_length()))
    return Microphones(np.array(runs, np.int64), near, far, line, gains, np.ones(1, np.int64))
