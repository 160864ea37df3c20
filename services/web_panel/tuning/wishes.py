"""What technicians want set, one after another: of each parameter the newest value wins while an older one waits."""

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from web_panel.rig.answer import Answer

_WHOLE = "*"  # no parameter's name


@dataclass(frozen=True)
class Wish:
    """Values to be set as one, SI units, by wire name.

    `lease` is the secret of who wishes, if they hold the writer's lease; `purpose` names what asked for a whole set.
    `before`: what held when it was wished.
    """

    values: dict[str, float]
    lease: str = ""
    purpose: str = ""
    before: dict[str, float] = field(default_factory=dict[str, float])

    @property
    def place(self) -> tuple[str, str]:
        """Where it waits, in the stead of an older one: for its parameter, or for whole sets, and for who wishes.
        Else one who is refused would take the place of who holds the lease.
        """
        return _WHOLE if self.purpose else next(iter(self.values)), self.lease


class Wishes:
    """One thread asks, so no two sets ever pass each other. `want` never blocks, any thread."""

    def __init__(self, ask: Callable[[Wish], Answer]) -> None:
        self._ask = ask
        self._wanted: dict[tuple[str, str], Wish] = {}
        self._changed = threading.Condition()
        self._ended = False
        self.answers: queue.SimpleQueue[tuple[Wish, Answer]] = queue.SimpleQueue()
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

    def want(self, wish: Wish) -> None:
        """Ask for this as soon as possible; the answer comes by `answers`."""
        with self._changed:
            if wish.purpose:
                self._wanted.pop(wish.place, None)  # it comes after every value that was wished before it
            self._wanted[wish.place] = wish
            self._changed.notify()

    def refuse(self, wish: Wish, reason: str) -> None:
        """Answer a wish that need not be sent."""
        self.answers.put((wish, Answer(reason=reason, refused=True)))

    def _run(self) -> None:
        while (wish := self._next()) is not None:
            self.answers.put((wish, self._ask(wish)))

    def _next(self) -> Wish | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._wanted)
            if self._ended:
                return None
            return self._wanted.pop(next(iter(self._wanted)))
