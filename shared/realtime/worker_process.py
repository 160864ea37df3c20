"""Worker process: JSON lines in, JSON lines out. `serve` is the worker's side, `WorkerProcess` that of whoever asks.

For what computes for long, or compiles first and has the interpreter to itself meanwhile. A worker ends with whoever
asks, however that ends: then its input is closed.
"""

import contextlib
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec

_NICENESS = 5  # behind all that plays; much more, and a busy machine would not get to it for minutes
_MOST_EXPENDABLE = "1000"

Answer = TypeVar("Answer")


class NoAnswer(Exception):
    """Reason why a question has no answer, in words."""


class WorkerProcess(Generic[Answer]):
    """Process of this command line, started by the first question. Any thread; one question at a time.

    One that ended is started again by the next question; after one that ended in place of an answer none is started
    for `rest_s`.
    """

    def __init__(
        self,
        command: Sequence[str],
        answers: Any,
        rest_s: float = 0.0,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        """answers: type of all answers, for msgspec."""
        self._command, self._decoder = command, msgspec.json.Decoder[Answer](answers)
        self._rest_s, self._now, self._rests_until_s = rest_s, now, -math.inf
        self._process: subprocess.Popen[bytes] | None = None
        self._asking, self._lock = threading.Lock(), threading.Lock()
        self._closed = False

    def ask(self, question: object) -> Answer:
        """Blocks until it is answered; raises NoAnswer."""
        with self._asking:
            if self._now() >= self._rests_until_s:
                process = self._started()
                assert process.stdin is not None
                assert process.stdout is not None
                with contextlib.suppress(BrokenPipeError, msgspec.DecodeError):  # ended, or out of step
                    process.stdin.write(msgspec.json.encode(question) + b"\n")
                    process.stdin.flush()
                    return self._decoder.decode(process.stdout.readline())
                self._bury()
                self._rests_until_s = self._now() + self._rest_s
            again = f": ask again in {self._rest_s:g} s" if self._rest_s else ""
            raise NoAnswer(f"the process that computes ended{again}")

    def close(self) -> None:
        """End the process. A question that is open has no answer, nor has any later one."""
        with self._lock:
            self._closed = True
            if self._process is not None:
                self._process.kill()
        with self._asking:
            self._bury()

    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is not None and self._process.poll() is not None:  # it ended meanwhile
            self._bury()
        with self._lock:  # so that `close` finds every process that there is
            if self._closed:
                raise NoAnswer("the process that computes was closed")
            if self._process is None:
                try:
                    # A session of its own: Ctrl-C in the terminal is for whoever asks, who ends it.
                    self._process = subprocess.Popen(
                        self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
                    )
                except OSError as error:  # no memory or no process is free: later, perhaps
                    why = f"the process that computes cannot be started: {error.strerror}"
                    raise NoAnswer(why) from None
            return self._process

    def _bury(self) -> None:
        with self._lock:
            process, self._process = self._process, None
        if process is not None:
            process.kill()
            with contextlib.suppress(BrokenPipeError), process:  # closes its pipes; a question may lie in one
                process.wait()


def serve(questions: Any, answer: Callable[[Any], object]) -> None:
    """Answer until the input ends, behind all that plays and first to go where memory ends. Main thread.

    questions: type of all questions, for msgspec.
    """
    os.setpriority(os.PRIO_PROCESS, 0, max(_NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))
    with contextlib.suppress(OSError):  # only Linux has it
        Path("/proc/self/oom_score_adj").write_text(_MOST_EXPENDABLE)
    decoder = msgspec.json.Decoder(questions)
    for line in sys.stdin.buffer:
        sys.stdout.buffer.write(msgspec.json.encode(answer(decoder.decode(line))) + b"\n")
        sys.stdout.buffer.flush()
