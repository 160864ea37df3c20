"""The process that finds rolls, seen from the gateway. One thread asks; `close` may come from another."""

import contextlib
import math
import subprocess
import threading
import time
from collections.abc import Callable, Sequence

import msgspec

from haptic_server.gateway.rolls.messages import Answer, Question, Refused

_REST_S = 10.0
_ENDED = f"the process that finds rolls ended: ask again in {_REST_S:g} s"


class FinderProcess:
    """Process of this command line, started by the first question; one that ended is started again by the next.

    After one that ended in place of an answer none is started for 10 s: each costs a second of a processor.
    """

    def __init__(self, words: Sequence[str], now: Callable[[], float] = time.monotonic) -> None:
        self._words, self._now = list(words), now
        self._rests_until_s = -math.inf
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._closed = False

    def ask(self, question: Question) -> Answer:
        """Blocks until it is answered."""
        if self._process is not None and self._process.poll() is not None:  # it ended meanwhile
            self._bury()
        if self._now() < self._rests_until_s:
            return Refused(_ENDED)
        try:
            process = self._started()
        except OSError as error:  # no memory or no process is free: later, perhaps
            return Refused(f"the process that finds rolls cannot be started: {error.strerror}")
        line = b""
        if process is not None and process.stdin is not None and process.stdout is not None:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.write(msgspec.json.encode(question) + b"\n")
                process.stdin.flush()
                line = process.stdout.readline()
        if line.endswith(b"\n"):
            return msgspec.json.decode(line, type=Answer)
        self._bury()
        self._rests_until_s = self._now() + _REST_S
        return Refused(_ENDED)

    def close(self) -> None:
        """End the process; a question that is open is answered with a refusal."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()

    def _started(self) -> subprocess.Popen[bytes] | None:
        with self._lock:
            if self._process is None and not self._closed:
                # A session of its own: Ctrl-C in the terminal is for the gateway, which ends it.
                self._process = subprocess.Popen(
                    self._words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
                )
            return self._process

    def _bury(self) -> None:
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.kill()
            with (
                contextlib.suppress(BrokenPipeError),
                process,
            ):  # closes its pipes; the question may lie in one
                process.wait()
