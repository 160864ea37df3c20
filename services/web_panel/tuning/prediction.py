"""What the newest wish would do, asked of the process that computes.

`ask` by any thread, what it returns by the one that sends wishes, the rest by the main one.
"""

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from drumstick.parameters.scene import Scene, as_tables
from web_panel.computing.computer import Computer
from web_panel.computing.questions import Foresee, Foreseen, Trouble

# A wish waits so long for its prediction: a slider that hung on a computation would be no instrument.
_PATIENCE_S = 0.05


class Newest(NamedTuple):
    """The newest answer, behind the number and the values of its question."""

    number: int
    values: dict[str, float]
    answer: Foreseen | Trouble


class Prediction:
    """Of one rig's scene; `asked` is the newest question's values, `asked_at` when (monotonic)."""

    def __init__(
        self, computer: Computer, patience_s: float = _PATIENCE_S, now: Callable[[], float] = time.monotonic
    ) -> None:
        self._computer = computer
        self._patience_s, self._now = patience_s, now
        self._scene: Scene | None = None
        self._rig: Foresee | None = None  # without values
        self.asked: dict[str, float] | None = None
        self.asked_at = float("-inf")
        self._number = 0  # of questions
        self._shown = 0  # number of the question whose answer the pages were handed; 0: of none
        self._changed = threading.Condition()

    def show_for(self, scene: Scene, limits: dict[str, float]) -> None:
        """The rig that the questions are about; what was asked about another one is forgotten."""
        with self._changed:
            if self._rig is None or scene is not self._scene or limits != self._rig.limits:
                self._scene, self._rig, self.asked = scene, Foresee(as_tables(scene), {}, limits), None
                self._computer.forget()

    def ask(self, values: dict[str, float]) -> Callable[[], bool]:
        """What would these values do? Returns what waits until the pages have been handed that, or something newer.

        It waits 50 ms from the asking at most, and not at all while there has been no answer: the first one compiles.
        """
        with self._changed:
            self._number += 1
            if (rig := self._rig) is not None:
                self.asked, self.asked_at = values, self._now()
                self._computer.ask(Foresee(rig.scene, values, rig.limits, self._number))
            return partial(self._wait_until_shown, self._number, self._now() + self._patience_s)

    def _wait_until_shown(self, number: int, until: float) -> bool:
        with self._changed:
            self._changed.wait_for(
                lambda: self._shown == 0 or self._shown >= number, max(0.0, until - self._now())
            )
            return self._shown >= number

    def note_shown(self, number: int) -> None:
        """The pages have been handed the answer to this question; 0: they are told that there is none."""
        with self._changed:
            self._shown = number
            self._changed.notify_all()

    @property
    def newest(self) -> Newest | None:
        """The newest answer; None while there is none."""
        newest = self._computer.newest
        if newest is None:
            return None
        question, answer = newest
        assert isinstance(question, Foresee)
        assert isinstance(answer, Foreseen | Trouble)
        if self._rig is None or question.scene is not self._rig.scene or question.limits != self._rig.limits:
            return None
        return Newest(question.number, question.values, answer)
