"""The head's surface as it is shown: heights on rings around the centre, whatever renders the head. Any thread.

On a mesh each place is the sum of the junctions around it by their nearness.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.interpolation import CORNERS, corners_of
from drumstick.drum.membrane.sweep import Head

RINGS, SPOKES = 16, 48

Numbers = npt.NDArray[np.float64]


def rings() -> tuple[Numbers, Numbers]:
    """x and y in radii of what is shown, shape (1 + 16 * 48,): the centre, then ring by ring; the rim itself rests."""
    r = np.repeat(np.arange(1, RINGS + 1) / (RINGS + 1), SPOKES)
    angle = np.tile(2.0 * math.pi * np.arange(SPOKES) / SPOKES, RINGS)
    return np.append(0.0, r * np.cos(angle)), np.append(0.0, r * np.sin(angle))


class Places(NamedTuple):
    """Places of the displayed values in what renders the head, and their shares: shape (N, C). `shapes`: None, or
    (769, N) from values to heights."""

    places: npt.NDArray[np.int64]
    shares: npt.NDArray[np.float32]
    shapes: Numbers | None


def on_mesh(head: Head) -> Places:
    """Places on a mesh."""
    spacing = float(head.grid["spacing"][0])
    x, y = rings()
    places, shares = np.zeros((len(x), CORNERS), np.int64), np.zeros((len(x), CORNERS), np.float32)
    for i in range(len(x)):
        around, near = corners_of(head, float(x[i]), float(y[i]))
        # Nearer to the rim than the last junctions: straight down to the rim, which rests.
        fall = min(1.0, (1.0 - math.hypot(x[i], y[i])) / spacing)
        places[i, : len(around)], shares[i, : len(around)] = around, fall * np.array(near)
    return Places(places, shares, None)
