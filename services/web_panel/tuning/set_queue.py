"""Queue of the sets that technicians request: the newest value of each parameter replaces one that still waits.

Requests are numbered from 1 in the order in which they were wanted. One that replaces another keeps that one's number
too: what waited for the older one waits for it.
"""

import queue
import threading
from collections.abc import Callable

from web_panel.rig.answer import Answer
from web_panel.rig.set_request import SetRequest


class SetQueue:
    """One thread asks, so no two sets ever pass each other. `want` and `has_answered` never block, any thread."""

    def __init__(self, ask: Callable[[SetRequest], Answer]) -> None:
        self._ask = ask
        self._wanted: dict[tuple[str, str], tuple[int, SetRequest]] = {}  # each with its oldest number
        self._changed = threading.Condition()
        self._newest, self._asking = 0, 0  # numbers; 0: none yet, none under way
        self._ended = False
        self.answers: queue.SimpleQueue[tuple[SetRequest, Answer]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="requests", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def close(self) -> None:
        """End after the question under way; what still waits is dropped."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def want(self, request: SetRequest) -> None:
        """Ask for this as soon as possible; the answer comes by `answers`."""
        with self._changed:
            self._newest += 1
            number, _ = self._wanted.get(request.place, (self._newest, request))
            if request.purpose:
                self._wanted.pop(
                    request.place, None
                )  # it comes after every value that was requested before it
            self._wanted[request.place] = number, request
            self._changed.notify()

    @property
    def newest(self) -> int:
        """Number of the request that was wanted last, 0 before the first."""
        with self._changed:
            return self._newest

    def has_answered(self, number: int) -> bool:
        """The request of this number and all before it have their answers in `answers`."""
        with self._changed:
            return not (0 < self._asking <= number or any(n <= number for n, _ in self._wanted.values()))

    def refuse(self, request: SetRequest, reason: str) -> None:
        """Answer a request that need not be sent."""
        self.answers.put((request, Answer(reason=reason, refused=True)))

    def _run(self) -> None:
        while (request := self._next()) is not None:
            self.answers.put((request, self._ask(request)))

    def _next(self) -> SetRequest | None:
        with self._changed:
            self._asking = 0
            self._changed.wait_for(lambda: self._ended or self._wanted)
            if self._ended:
                return None
            self._asking, request = self._wanted.pop(next(iter(self._wanted)))
            return request
