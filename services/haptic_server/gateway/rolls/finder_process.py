"""The process that finds rolls, seen from the gateway. One thread asks; `close` may come from another."""

import contextlib
import subprocess
import threading
from collections.abc import Sequence

import msgspec

from haptic_server.gateway.rolls.messages import Answer, Question, Refused


class FinderProcess:
    """Process of this command line, started by the first question; one that ended is started again by the next."""

    def __init__(self, words: Sequence[str]) -> None:
        self._words = list(words)
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._closed = False

    def ask(self, question: Question) -> Answer:
        """Blocks until it is answered."""
        if self._process is not None and self._process.poll() is not None:  # it ended meanwhile
            self._bury()
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
        return Refused("the process that finds rolls ended: ask again")

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
