"""Delay and jitter of arriving strikes: from the contact to their arrival here, by the mapped clock.

`note` is for the one thread that reads strikes; `summary` for any.
"""

from typing import NamedTuple

import numpy as np

_KEPT = 256


class Summary(NamedTuple):
    """Statistics of the newest 256 strikes: the median time from contact to arrival, and the slowest twentieth's lag
    behind the quickest, ms; and how many strikes ever came after the instant at which they should have sounded.
    """

    arrival_ms: float
    jitter_ms: float
    unpunctual: int


class ArrivalStatistics:
    """Arrival statistics of one rig's strikes."""

    def __init__(self) -> None:
        self._took_ns = np.zeros(_KEPT, np.int64)
        self._noted = 0
        self._unpunctual = 0

    def note(self, took_ns: int, latency_ns: int) -> None:
        """A strike came `took_ns` after its contact; it was to sound `latency_ns` after that (0: as soon as may be)."""
        self._took_ns[self._noted % _KEPT] = took_ns
        self._noted += 1
        self._unpunctual += took_ns > latency_ns > 0

    def summary(self) -> Summary:
        """Present delay, jitter and number of late strikes."""
        count = min(self._noted, _KEPT)
        if count == 0:
            return Summary(0.0, 0.0, 0)
        low, middle, high = np.percentile(self._took_ns[:count], (5, 50, 95)) / 1e6
        return Summary(float(middle), float(high - low), self._unpunctual)
