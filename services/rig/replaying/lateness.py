"""Lateness of replayed messages, counted in bins so that a loop may run for days. The playing thread only."""

_BIN_NS = 50_000
_BINS = 2000
LATE_NS = 2_000_000  # what is later counts as late


class Lateness:
    """Histogram of lateness behind absolute deadlines."""

    def __init__(self) -> None:
        self._bins = [0] * _BINS
        self.count = self.late = self.worst_ns = 0

    def note(self, late_ns: int) -> None:
        """One message went out so long after its time; it never goes before."""
        self._bins[min(max(late_ns, 0) // _BIN_NS, _BINS - 1)] += 1
        self.count += 1
        self.late += late_ns > LATE_NS
        self.worst_ns = max(self.worst_ns, late_ns)

    def percentile_us(self, share: float) -> float:
        """Not more than so late were `share` (0..1) of them; to 50 us, and 100 ms at most. 0 without any."""
        wanted, seen = share * self.count, 0
        for index, count in enumerate(self._bins):
            seen += count
            if count and seen >= wanted:
                return (index + 1) * _BIN_NS / 1e3
        return 0.0
