"""A head in memory, at rest, and how pickups hear it. Allocates; any thread."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.interpolation import corners_of
from drumstick.drum.membrane.lattice import Lattice, strips_of
from drumstick.drum.membrane.sweep import SQUARE, TRIANGULAR, Head

if TYPE_CHECKING:
    from drumstick.parameters.scene import Scene


def aligned(shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """Zeros that begin on a 64-byte boundary."""
    count = math.prod(shape)
    room = np.zeros(count + 16, np.float32)
    skip = (-room.ctypes.data) % 64 // 4
    return room[skip : skip + count].reshape(shape)


def head_of(lattice: Lattice, weight_scale: float) -> Head:
    """A head at rest on this lattice; `weight_scale` is what its weights are multiplied with."""
    size = lattice.weights.size
    weights = aligned((size,))
    weights[:] = (weight_scale * lattice.weights).ravel()
    grid: Any = np.zeros(1, TRIANGULAR if lattice.topology.shifted else SQUARE)
    grid["spacing"], grid["stride"] = lattice.spacing, lattice.weights.shape[1]
    grid["centre_row"], grid["centre_column"] = lattice.centre_row, lattice.centre_column
    return Head(_time_levels(size), weights, strips_of(lattice), grid)


def _time_levels(size: int) -> npt.NDArray[np.float32]:
    # Each of the two begins on a boundary of its own, and a vector before and behind it belongs to the array.
    return aligned((2, size))


def panned(pan: float) -> tuple[float, float]:
    """Left and right, of equal power."""
    angle = (pan + 1.0) * math.pi / 4.0
    return math.cos(angle), math.sin(angle)


Heard = tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]


def pickups_on(scene: "Scene", head: Head, level: float) -> Heard:
    """The junctions that the scene's pickups hear on this head, (n,), and how much of each left and right, (n, 2).

    Those of a pickup that can be moved stand there twice, the second time silent.
    """
    places, gains = _around_pickups(scene, head, level)
    return (
        pickups_moved(scene, head, level, np.repeat(places, 2), 0)
        if scene.listen.pickup_places == "live"
        else (places, gains)
    )


def pickups_moved(
    scene: "Scene", head: Head, level: float, before: npt.NDArray[np.int64], half: int
) -> Heard:
    """Junctions and gains of pickups that are moved to the scene's places, in that half of their junctions; the other
    one, which stays where it was `before`, is silent."""
    places, gains = _around_pickups(scene, head, level)
    count = len(scene.listen.pickups)
    moved, heard = before.copy(), np.zeros((len(before), 2), np.float32)
    moved.reshape(count, 2, -1)[:, half] = places.reshape(count, -1)
    heard.reshape(count, 2, -1)[:, half] = gains.reshape(count, -1)
    return moved, heard


def _around_pickups(scene: "Scene", head: Head, level: float) -> Heard:
    places: list[int] = []
    gains: list[tuple[float, float]] = []
    pickups = () if scene.listen.microphones else scene.listen.pickups
    for x, y, pan in pickups:
        left, right = panned(pan)
        for place, share in zip(*corners_of(head, x, y), strict=True):
            places.append(place)
            gains.append((level * share * left, level * share * right))
    return np.array(places, np.int64), np.array(gains, np.float32).reshape(-1, 2)
