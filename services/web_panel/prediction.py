"""What the newest wish would do, asked of the process that computes.

`ask` by any thread, `wait_until_shown` by the one that sends wishes, the rest by the main one.
"""

import threading
import time

from drumstick.scene import Scene, as_tables
from web_panel.computing.computer import Computer
from web_panel.computing.questions import Foresee, Foreseen, Trouble


class Prediction:
    """Of one rig's scene; `asked` is the newest question's values, `asked_at` when (monotonic)."""

    def __init__(self, computer: Computer) -> None:
        self._computer = computer
        self._scene: Scene | None = None
        self._rig: Foresee | None = None  # without values
        self.asked: dict[str, float] | None = None
        self.asked_at = float("-inf")
        self._shown: dict[str, float] | None = None
        self._changed = threading.Condition()

    def show_for(self, scene: Scene, limits: dict[str, float]) -> None:
        """The rig that the questions are about; what was asked about another one is forgotten."""
        if self._rig is None or scene is not self._scene or limits != self._rig.limits:
            self._scene, self._rig, self.asked = scene, Foresee(as_tables(scene), {}, limits), None
            self._computer.forget()

    def ask(self, values: dict[str, float]) -> None:
        """What would these values do?"""
        if (rig := self._rig) is not None:
            self.asked, self.asked_at = values, time.monotonic()
            self._computer.ask(Foresee(rig.scene, values, rig.limits))

    def note_shown(self, values: dict[str, float] | None) -> None:
        """The pages have been handed what these values would do."""
        with self._changed:
            self._shown = values
            self._changed.notify()

    def wait_until_shown(self, at_most_s: float) -> bool:
        """Wait until what was asked newest is shown. False, at once, while nothing is: the first one compiles."""
        with self._changed:
            return self._shown is not None and self._changed.wait_for(
                lambda: self._shown is None or self._shown == self.asked, at_most_s
            )

    @property
    def newest(self) -> tuple[dict[str, float], Foreseen | Trouble] | None:
        """The newest answer behind the values that it is about; None while there is none."""
        newest = self._computer.newest
        if newest is None:
            return None
        question, answer = newest
        assert isinstance(question, Foresee)
        assert isinstance(answer, Foreseen | Trouble)
        if self._rig is None or question.scene is not self._rig.scene or question.limits != self._rig.limits:
            return None
        return question.values, answer
