"""Rate limit per source: replies to a flood are dropped, replies to a mistake are not."""

import math
from collections.abc import Hashable


class ReplyRateLimit:
    """Counts by source in windows of one second, and all sources together.

    The sum bounds how many sources are remembered. One thread only (the OSC receive thread); never blocks.
    """

    def __init__(self, per_source: int, in_all: int) -> None:
        self._per_source = per_source
        self._in_all = in_all
        self._window = -1
        self._sum = 0
        self._spent: dict[Hashable, int] = {}

    def spend(self, source: Hashable, now_s: float) -> bool:
        """Take one; False when the source, or all together, have had theirs in this second."""
        window = math.floor(now_s)
        if window != self._window:
            self._window = window
            self._sum = 0
            self._spent.clear()
        spent = self._spent.get(source, 0)
        if spent >= self._per_source or self._sum >= self._in_all:
            return False
        self._spent[source] = spent + 1
        self._sum += 1
        return True

    @property
    def remembered(self) -> int:
        """Number of sources remembered now; never more than `in_all`."""
        return len(self._spent)
