"""Log lines that a flood cannot multiply: the first at once, then at most one a second, with the number left out."""

import logging
import threading
from collections.abc import Callable

_QUIET_NS = 1_000_000_000


class Complaints:
    """Any thread; `clock` returns monotonic ns."""

    def __init__(self, clock: Callable[[], int]) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._next_ns = 0
        self._silenced = 0

    def complain(self, words: str) -> None:
        """Log `words` as a warning, or count it when a line was written less than a second ago."""
        with self._lock:
            now = self._clock()
            if now < self._next_ns:
                self._silenced += 1
                return
            silenced, self._silenced = self._silenced, 0
            self._next_ns = now + _QUIET_NS
        also = f" (and {silenced} more)" if silenced else ""
        logging.warning("%s%s", words, also)
