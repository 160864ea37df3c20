"""The process that computes, seen from the panel: it is asked without waiting, and the newest question wins.

`ask` may be called by any thread and never blocks; `forget` and `close` belong to the main thread.
"""

import contextlib
import subprocess
import sys
import threading
from collections.abc import Sequence
from typing import NamedTuple

import msgspec

from web_panel.computing.computing_messages import Answer, Question, Trouble

COMMAND = (sys.executable, "-m", "web_panel.computing")
_AGAIN_AFTER_S = 2.0


class Computed(NamedTuple):
    """A question and its answer."""

    question: Question
    answer: Answer


class Computer:
    """Its process starts with the first question and ends with `close`. One that died starts again with the next."""

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        self._command = command
        self._process: subprocess.Popen[bytes] | None = None
        self._wanted: Question | None = None
        self._under_way: Question | None = None
        self._changed = threading.Condition()
        self._ended = threading.Event()
        self.newest: Computed | None = None
        self._thread = threading.Thread(target=self._run, name="computer", daemon=True)
        self._thread.start()

    @property
    def busy(self) -> bool:
        """True while a question waits or is computed."""
        return self._wanted is not None or self._under_way is not None

    def ask(self, question: Question) -> None:
        """Its answer will be `newest`, unless another question comes before this one's turn."""
        with self._changed:
            self._wanted = question
            self._changed.notify()

    def forget(self) -> None:
        """Drop all questions asked up to now, and their answers."""
        with self._changed:
            self._wanted = self._under_way = self.newest = None

    def close(self) -> None:
        """End, and the process with it."""
        self._ended.set()
        with self._changed:
            self._changed.notify()
            if self._process is not None:
                self._process.kill()
        self._thread.join()

    def _run(self) -> None:
        while (question := self._next()) is not None:
            why = "the process that computes ended"
            try:
                answer = self._answer(question)
            except OSError as error:  # no memory or no process is free: later, perhaps
                answer, why = None, f"the process that computes cannot be started: {error.strerror}"
            with self._changed:
                if self._under_way is question:
                    self.newest = Computed(question, answer or Trouble(why))
                    self._under_way = None
            if answer is None:
                self._ended.wait(_AGAIN_AFTER_S)
        if self._process is not None:
            self._bury(self._process)

    def _next(self) -> Question | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended.is_set() or self._wanted is not None)
            if self._ended.is_set():
                return None
            self._under_way, self._wanted = self._wanted, None
            return self._under_way

    def _started(self) -> subprocess.Popen[bytes] | None:
        # Under the lock, so that `close` finds every process that there is.
        with self._changed:
            if self._process is None and not self._ended.is_set():
                self._process = subprocess.Popen(
                    self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True
                )
            return self._process

    def _answer(self, question: Question) -> Answer | None:
        process = self._started()
        if process is None:
            return None
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(msgspec.json.encode(question) + b"\n")
            process.stdin.flush()
            line = process.stdout.readline()
        except BrokenPipeError:
            line = b""
        if line.endswith(b"\n"):
            with contextlib.suppress(msgspec.DecodeError):  # then it is out of step, and starts anew
                return msgspec.json.decode(line, type=Answer)
        self._bury(process)
        return None

    def _bury(self, process: subprocess.Popen[bytes]) -> None:
        process.kill()
        with process:  # closes its pipes
            process.wait()
        with self._changed:
            self._process = None
