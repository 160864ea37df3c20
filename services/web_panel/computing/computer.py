"""The process that computes, seen from the panel: it is asked without waiting, and the newest question wins.

`ask` may be called by any thread and never blocks; `forget` and `close` belong to the main thread.
"""

import sys
import threading
from collections.abc import Sequence
from typing import NamedTuple

from realtime.worker_process import NoAnswer, WorkerProcess
from web_panel.computing.computing_messages import Answer, Question, Trouble

COMMAND = (sys.executable, "-m", "web_panel.computing")
_AGAIN_AFTER_S = 2.0
_TRIES = 30  # a minute at least: one that ends the process itself is not asked for ever


class Computed(NamedTuple):
    """A question and its answer."""

    question: Question
    answer: Answer


class Computer:
    """Its process starts with the first question and ends with `close`. One that died starts again with the next."""

    def __init__(self, command: Sequence[str] = COMMAND) -> None:
        self._process = WorkerProcess[Answer](command, Answer)
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
        self._process.close()
        self._thread.join()

    def _run(self) -> None:
        failed: list[Question] = []  # one question, as often as it had no answer
        while (question := self._next()) is not None:
            try:
                answer, rest_s = self._process.ask(question), 0.0
            except NoAnswer as reason:
                failed = [*failed, question] if question in failed else [question]
                answer, rest_s = Trouble(str(reason), passes=len(failed) < _TRIES), _AGAIN_AFTER_S
            with self._changed:
                if self._under_way is question:
                    self.newest = Computed(question, answer)
                    self._under_way = None
            self._ended.wait(rest_s)

    def _next(self) -> Question | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended.is_set() or self._wanted is not None)
            if self._ended.is_set():
                return None
            self._under_way, self._wanted = self._wanted, None
            return self._under_way
