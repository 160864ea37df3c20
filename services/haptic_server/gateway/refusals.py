"""Whom Zenoh turned away at the public listener, counted from its own log: it keeps no such numbers itself.

Two kinds are told there: handshakes that failed (no certificate, another authority's, out of date, no TLS at all) and
certificates of no admitted role. Zenoh lets ten failed handshakes through in a second at most, so its log cannot flood
us. What a role's owner tries beyond his rights is refused without a trace: Zenoh tells that only in a log that tells of
every permitted message as well.

Zenoh logs to the process's standard output; that is turned into a pipe here, and a thread of its own reads it. Who sets
RUST_LOG gets the log that he asks for, by way of ours, and these counters count what of it is a refusal.
"""

import logging
import os
import re
import sys
import threading
import time
from collections.abc import Callable

_log = logging.getLogger("gateway")
_FILTER = "error,zenoh_link_tls=warn,zenoh::net::routing::interceptor::access_control=info"
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_HANDSHAKE = re.compile(r"zenoh_link_tls\S*: (?P<why>.*?)\. Hint: ")
_NO_ROLE = re.compile(r"access_control: (?P<who>[0-9a-f]+) did not match any configured ACL subject")
_LINE_EVERY_S = 10.0


class Refusals:
    """Counters may be read from any thread; `take` belongs to the one that reads."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._tell_at_s = float("-inf")
        self._untold = 0
        self.handshakes = 0
        self.without_role = 0
        self.last = ""

    def take(self, line: str) -> None:
        """One line of Zenoh's log. Others than refusals are handed on to our own log."""
        words = _COLOURS.sub("", line).strip()
        if found := _HANDSHAKE.search(words):
            self.handshakes += 1
            self._note(f"a handshake failed: {found['why']}")
        elif _NO_ROLE.search(words):
            self.without_role += 1
            self._note("a certificate of no admitted role came in, and may do nothing")
        elif words:
            _log.warning("%s", words)

    def _note(self, words: str) -> None:
        self.last = words
        self._untold += 1
        if self._now() >= self._tell_at_s:
            self._tell_at_s = self._now() + _LINE_EVERY_S
            _log.warning("public listener: refused %d, last: %s", self._untold, words)
            self._untold = 0

    def counters(self) -> dict[str, int | str]:
        """For `doctor`."""
        return {"handshakes_refused": self.handshakes, "without_role": self.without_role, "last": self.last}

    def follow_zenoh(self) -> None:
        """Begin to read Zenoh's log. Once in a process, before its first session; standard output is gone from then."""
        import zenoh

        sys.stdout.flush()
        inner, outer = os.pipe()
        os.dup2(outer, 1)
        os.close(outer)
        zenoh.init_log_from_env_or(_FILTER)
        threading.Thread(target=self._read, args=(inner,), name="zenoh log", daemon=True).start()

    def _read(self, inner: int) -> None:
        with os.fdopen(inner, encoding="utf-8", errors="replace") as lines:
            for line in lines:
                self.take(line)
