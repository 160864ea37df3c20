"""Strikes on their way to the audio thread: a record, and a ring with one producer (the network's thread)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from realtime import ring
from realtime.records import Record, Records, dtype_of

RING_SLOTS = 256


class StrikeEvent(Record):
    """`onset_ns` is this machine's monotonic time at which the force begins; 0 means at once. An impulse of 0 was not
    told. The speed is for mallets: one of 0 never comes to the head.
    """

    onset_ns: int
    x: float
    y: float
    peak_N: float
    contact_s: float
    impulse_N_s: float
    speed_m_per_s: float


EVENT = dtype_of(StrikeEvent)


class StrikeRing:
    """`cells` int64 and `slots` EVENT, shape (256,). `push` belongs to one thread; it never blocks."""

    def __init__(self) -> None:
        self.cells: npt.NDArray[np.int64] = ring.new_cells()
        self.slots: Records = np.zeros(RING_SLOTS, EVENT)
        self._event: Records = np.zeros(1, EVENT)

    def push(
        self,
        onset_ns: int,
        x: float,
        y: float,
        peak_N: float,
        contact_s: float,
        impulse_N_s: float = 0.0,
        speed_m_per_s: float = 0.0,
    ) -> bool:
        """Hand a strike to the audio thread; False when 256 are waiting already."""
        self._event[0] = (onset_ns, x, y, peak_N, contact_s, impulse_N_s, speed_m_per_s)
        return bool(ring.push(self.cells, self.slots, self._event[0]))

    def push_blow(self, blow: "OfflineStrike", onset_ns: int = 0) -> bool:
        """`push` what a blow says, whatever its own time is."""
        return self.push(
            onset_ns, blow.x, blow.y, blow.peak_N, blow.contact_s, blow.impulse_N_s, blow.speed_m_per_s
        )


@dataclass(frozen=True)
class OfflineStrike:
    """One strike for the offline renderer: when, where (in radii), how hard, how long; 0 N s: a half-sine.

    The speed is what a mallet has; a scene without one does not look at it.
    """

    t_s: float
    x: float
    y: float
    peak_N: float
    contact_s: float
    impulse_N_s: float = 0.0
    speed_m_per_s: float = 0.0
