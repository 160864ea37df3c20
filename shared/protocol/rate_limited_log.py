"""Log lines that a flood cannot multiply: the first at once, then at most one in a while, with the number left out."""

import logging
import threading
from collections.abc import Callable

from protocol.foreign_text import shown

_LONGEST = 300


class RateLimitedLog:
    """Any thread; `clock` returns monotonic ns. What it keeps does not grow, whatever it is told."""

    def __init__(
        self,
        clock: Callable[[], int],
        quiet_s: float = 1.0,
        say: Callable[[str], None] = lambda line: logging.warning("%s", line),
    ) -> None:
        """`quiet_s`: at least so long from line to line. `say` hears the lines."""
        self._clock = clock
        self._quiet_ns = round(quiet_s * 1e9)
        self._say = say
        self._lock = threading.Lock()
        self._next_ns = 0
        self._silenced = 0

    def warn(self, words: str) -> None:
        """Log `words` as a warning, escaped and cut, or count it when a line was written a moment ago."""
        with self._lock:
            now = self._clock()
            if now < self._next_ns:
                self._silenced += 1
                return
            silenced, self._silenced = self._silenced, 0
            self._next_ns = now + self._quiet_ns
        also = f" (and {silenced} more)" if silenced else ""
        self._say(shown(words, _LONGEST) + also)
