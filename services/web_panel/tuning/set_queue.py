"""Queue of the sets that technicians request: the newest value of each parameter replaces one that still waits."""

import queue
import threading
from collections.abc import Callable

from web_panel.rig.answer import Answer
from web_panel.rig.set_request import SetRequest


class SetQueue:
    """One thread asks, so no two sets ever pass each other. `want` never blocks, any thread."""

    def __init__(self, ask: Callable[[SetRequest], Answer]) -> None:
        self._ask = ask
        self._wanted: dict[tuple[str, str], SetRequest] = {}
        self._changed = threading.Condition()
        self._ended = self._asking = False
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
            if request.purpose:
                self._wanted.pop(
                    request.place, None
                )  # it comes after every value that was requested before it
            self._wanted[request.place] = request
            self._changed.notify()

    def is_idle(self) -> bool:
        """Nothing waits and nothing is under way: all that was asked has its answer in `answers`."""
        with self._changed:
            return not (self._wanted or self._asking)

    def refuse(self, request: SetRequest, reason: str) -> None:
        """Answer a request that need not be sent."""
        self.answers.put((request, Answer(reason=reason, refused=True)))

    def _run(self) -> None:
        while (request := self._next()) is not None:
            self.answers.put((request, self._ask(request)))

    def _next(self) -> SetRequest | None:
        with self._changed:
            self._asking = False
            self._changed.wait_for(lambda: self._ended or self._wanted)
            if self._ended:
                return None
            self._asking = True
            return self._wanted.pop(next(iter(self._wanted)))
