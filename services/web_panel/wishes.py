"""What technicians want set, one after another: for each parameter the newest value wins while an older one waits."""

import queue
import threading
from collections.abc import Callable

from web_panel.answer import Answer


class Wishes:
    """One thread asks, so no two sets of one parameter ever pass each other. `want` never blocks, any thread."""

    def __init__(self, ask: Callable[[str, float], Answer]) -> None:
        self._ask = ask
        self._wanted: dict[str, float] = {}
        self._changed = threading.Condition()
        self._ended = False
        self.answers: queue.SimpleQueue[tuple[str, float, Answer]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="wishes", daemon=True)

    def start(self) -> None:
        """Begin to ask."""
        self._thread.start()

    def close(self) -> None:
        """End after the question under way; what still waits is dropped."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()

    def want(self, name: str, value: float) -> None:
        """Ask for this value as soon as possible. The answer comes by `answers`."""
        with self._changed:
            self._wanted[name] = value
            self._changed.notify()

    def refuse(self, name: str, value: float, reason: str) -> None:
        """Answer a wish that need not be sent."""
        self.answers.put((name, value, Answer(reason=reason, refused=True)))

    def _run(self) -> None:
        while (wish := self._next()) is not None:
            name, value = wish
            self.answers.put((name, value, self._ask(name, value)))

    def _next(self) -> tuple[str, float] | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._wanted)
            if self._ended:
                return None
            name = next(iter(self._wanted))
            return name, self._wanted.pop(name)
