"""Strikes on their way to the audio thread: a record, and a ring with one producer (the network's thread)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from realtime import ring
from realtime.jit import Records

RING_SLOTS = 256

# `onset_ns` is this machine's monotonic time at which the force begins; 0 means at once. An impulse of 0 was not told.
EVENT: np.dtype[Any] = np.dtype(
    [
        ("onset_ns", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("peak_N", "f8"),
        ("contact_s", "f8"),
        ("impulse_N_s", "f8"),
    ],
    align=True,
)


class StrikeRing:
    """`cells` int64 and `slots` EVENT, shape (256,). `push` belongs to one thread; it never blocks."""

    def __init__(self) -> None:
        self.cells: npt.NDArray[np.int64] = ring.new_cells()
        self.slots: Records = np.zeros(RING_SLOTS, EVENT)
        self._event: Records = np.zeros(1, EVENT)

    def push(
        self, onset_ns: int, x: float, y: float, peak_N: float, contact_s: float, impulse_N_s: float = 0.0
    ) -> bool:
        """Hand a strike to the audio thread; False when 256 are waiting already."""
        self._event[0] = (onset_ns, x, y, peak_N, contact_s, impulse_N_s)
        return bool(ring.push(self.cells, self.slots, self._event[0]))


@dataclass(frozen=True)
class Blow:
    """One strike for the offline renderer: when, where (in radii), how hard, how long; 0 N s: a half-sine."""

    t_s: float
    x: float
    y: float
    peak_N: float  # noqa: N815
    contact_s: float
    impulse_N_s: float = 0.0  # noqa: N815
