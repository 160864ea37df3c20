"""Microphones above a mesh."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

VECTORS = 4  # of a packet


class Packets(NamedTuple):
    """P packets over vectors of W lanes. Shapes: delays (P,), in steps, of a packet's first; places (P VECTORS,), the
    first junctions of its vectors; weights (P VECTORS, 2, W)."""

    delays: npt.NDArray[np.int32]
    places: npt.NDArray[np.int32]
    weights: npt.NDArray[np.float32]


class Microphones(NamedTuple):
    """M microphones. Shapes: packets of all; ends (M + 1,): first packet of each, and the end; line (M, a power of 2,
    lanes): what is on its way; before (M,): what the last step brought; gains (M, 2); at (1,): steps so far."""

    packets: Packets
    ends: npt.NDArray[np.int64]
    line: npt.NDArray[np.float32]
    before: npt.NDArray[np.float64]
    gains: npt.NDArray[np.float64]
    at: npt.NDArray[np.int64]
