"""Microphones in the air above the head: every junction is heard after its distance, and the weaker the farther.

The head in an infinite baffle radiates p(t) = rho/(2 pi) sum of A_j a_j(t - r_j/c)/r_j, with a_j each junction's
acceleration, A_j its area and r_j its distance (Rayleigh's integral). Each junction's velocity goes into a line of the
sounds that are on their way, shared by its nearness between two steps; what comes out is the line's change. How the
velocities are summed stands in `arrivals`. Kernels: audio thread.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.membrane.lattice import Lattice
from drumstick.drum.membrane.simd import WIDTH
from drumstick.drum.memory.microphones import Microphones, Packets
from drumstick.drum.output import stems
from drumstick.drum.output.arrivals import Sending, packets_of, send_of
from drumstick.parameters.scene import Scene
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]
_send = send_of(WIDTH)


@njit(fastmath={"reassoc"})
def _arrived(line: Floats, m: int, turn: int) -> float:
    # Empties the place too: it is free for what will arrive once the line has come round.
    total = 0.0
    for lane in range(line.shape[2]):
        total += line[m, turn, lane]
        line[m, turn, lane] = np.float32(0.0)
    return total


@only_with("microphones", otherwise=(0.0, 0.0))
def captured(engine: "Engine", u: Floats, u_new: Floats) -> Any:
    """Send off what the head's step radiates; returns what arrives, left and right."""
    air = engine.microphones
    packets = Packets(air.packets.delays, air.packets.places, air.packets.weights)
    now, steps = air.at[0], air.line.shape[1]
    left, right = 0.0, 0.0
    for m in range(air.line.shape[0]):
        sending = Sending(air.ends[m], air.ends[m + 1], m * steps, steps - 1, now)
        _send(u, u_new, packets, air.line, sending)
        flow = _arrived(air.line, m, now & (steps - 1))
        left += air.gains[m, 0] * (flow - air.before[m])
        right += air.gains[m, 1] * (flow - air.before[m])
        stems.add_microphone(engine, m, flow - air.before[m])
        air.before[m] = flow
    air.at[0] = now + 1
    return left, right


@only_with("microphones")
def reset(engine: "Engine") -> None:
    """Empty the delay lines."""
    engine.microphones.line[:] = np.float32(0.0)
    engine.microphones.before[:] = 0.0


def paths(
    scene: Scene, lattice: Lattice, step_s: float
) -> Iterator[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]:
    """Delay in steps and area / distance of all junctions, to each of the scene's microphones; flat."""
    rows, columns = lattice.weights.shape
    inside = (lattice.weights > 0.0).ravel()
    row, column = (axis.ravel() for axis in np.indices((rows, columns)))
    shift = 0.5 * ((row - lattice.centre_row) & 1) if lattice.topology.shifted else 0.0
    x = (column - lattice.centre_column + shift) * lattice.spacing
    y = (row - lattice.centre_row) * lattice.topology.row_height * lattice.spacing
    area = np.zeros(inside.size)
    area[inside] = 1.0 / (lattice.topology.neighbours * lattice.weights.ravel()[inside])
    for at_x, at_y, at_z, _ in scene.listen.microphones:
        distance = np.sqrt((x - at_x) ** 2 + (y - at_y) ** 2 + at_z**2)
        yield distance * scene.drum.radius_m / SOUND_M_PER_S / step_s, area / distance


def microphones_of(scene: Scene, lattice: Lattice, step_s: float) -> Microphones:
    """The scene's, above a head on this lattice. Allocates; any thread."""
    found, longest = zip(*(packets_of(*path, WIDTH) for path in paths(scene, lattice, step_s)), strict=True)
    delays, places, weights = (np.concatenate(parts) for parts in zip(*found, strict=True))
    packed = aligned(weights.shape)
    packed[:] = weights
    angles = [(pan + 1.0) * math.pi / 4.0 for *_, pan in scene.listen.microphones]  # equal power
    return Microphones(
        Packets(delays, places, packed),
        np.cumsum([0, *(len(each.delays) for each in found)]),
        aligned((len(found), 1 << max(longest).bit_length(), WIDTH)),
        np.zeros(len(found)),
        np.array([(math.cos(angle), math.sin(angle)) for angle in angles]),
        np.zeros(1, np.int64),
    )
