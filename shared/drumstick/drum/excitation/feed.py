"""The producer's side of a stream: samples into the audio thread's ring. One thread; never blocks."""

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.timeline import PIECE, PIECE_MOST, Stream
from realtime import ring
from realtime.records import Records

Forces = npt.NDArray[np.float32]


class Feed:
    """Writer of one stream."""

    def __init__(self, stream: Stream) -> None:
        self.stream = stream
        self._piece: Records = np.zeros(1, PIECE)

    def push(
        self, epoch: int, first: int, start_ns: int, period_ns: float, x: float, y: float, forces: Forces
    ) -> bool:
        """Hand on forces, N, whose first begins at start_ns of our clock; False when the ring is full."""
        piece = self._piece
        for done in range(0, len(forces), PIECE_MOST):
            run = forces[done : done + PIECE_MOST]
            piece["epoch"], piece["first"], piece["count"] = epoch, first + done, len(run)
            piece["start_ns"], piece["period_ns"] = start_ns + round(done * period_ns), period_ns
            piece["x"], piece["y"] = x, y
            piece["forces"][0, : len(run)] = run
            if not ring.push(self.stream.ring_cells, self.stream.ring_slots, piece[0]):
                return False
        return True

    @property
    def block_s(self) -> float:
        """Length of the audio thread's blocks, s; 0 before the first."""
        return float(self.stream.state["block_ns"][0]) * 1e-9
