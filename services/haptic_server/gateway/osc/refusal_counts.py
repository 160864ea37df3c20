"""Counts of refused messages by reason, logged in at most one line a second."""

import logging
import threading
from collections import Counter

from protocol.foreign_text import shown

_LINE_EVERY_S = 1.0
_LONGEST = 300
_log = logging.getLogger(__name__)


class RefusalCounts:
    """Any thread; held locks are short. Writes to the log at most once a second."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._unlogged = 0
        self._last = ""
        self._logged_at_s = float("-inf")
        self._lock = threading.Lock()

    def count(self, what: str) -> None:
        """Only count."""
        with self._lock:
            self._counts[what] += 1

    def refuse(self, reason: str, source: str, why: str, now_s: float) -> None:
        """Count a refusal under `reason`, and tell about it when a second has passed since the last line."""
        with self._lock:
            self._counts[reason] += 1
            self._unlogged += 1
            self._last = f"from {source}, last: {shown(why, _LONGEST)}"
        self.log_line(now_s)

    def log_line(self, now_s: float, *, at_once: bool = False) -> None:
        """Write the line that is due, if any."""
        with self._lock:
            if not self._unlogged or not (at_once or now_s - self._logged_at_s >= _LINE_EVERY_S):
                return
            line = f"osc: refused {self._unlogged} {self._last}"
            self._unlogged = 0
            self._logged_at_s = now_s
        _log.warning("%s", line)

    def counters(self) -> dict[str, int]:
        """A copy of every count."""
        with self._lock:
            return dict(self._counts)
