"""Rate limit of played strikes: what one source, and all of them together, may play. The caller's lock guards it."""

from collections.abc import Hashable
from typing import NamedTuple

_MAX_SOURCES = 1024


class Pace(NamedTuple):
    """Strikes a second, and how many at once after a pause."""

    per_s: float
    at_once: float


# Two hands play forty a second. The sound server's drum has 32 blows in it at most, and the stick's are among them.
OF_ONE, OF_ALL = Pace(100.0, 12.0), Pace(200.0, 20.0)


class _Bucket:
    def __init__(self, pace: Pace, now_s: float) -> None:
        self._pace, self._left, self._at_s = pace, pace.at_once, now_s

    def has_one(self, now_s: float) -> bool:
        self._left = min(self._pace.at_once, self._left + self._pace.per_s * (now_s - self._at_s))
        self._at_s = now_s
        return self._left >= 1.0

    def spend(self) -> None:
        self._left -= 1.0


class PlayRateLimit:
    """Buckets that fill with time: one for each source, and one for all of them."""

    def __init__(self) -> None:
        self._all = _Bucket(OF_ALL, 0.0)
        self._buckets: dict[Hashable, _Bucket] = {}

    def spend(self, source: Hashable, now_s: float) -> bool:
        """Take one strike; False when the source, or all together, have had theirs."""
        bucket = self._buckets.pop(source, None) or _Bucket(OF_ONE, now_s)
        if len(self._buckets) >= _MAX_SOURCES:
            del self._buckets[next(iter(self._buckets))]  # whoever asked longest ago
        self._buckets[source] = bucket
        if not (bucket.has_one(now_s) and self._all.has_one(now_s)):
            return False
        bucket.spend()
        self._all.spend()
        return True
