"""The predicted effect of the newest requested values, computed by another process.

`ask` by any thread, the rest by the main one.
"""

import threading
import time
from typing import NamedTuple

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from web_panel.computing.computer import Computer
from web_panel.computing.computing_messages import PredictedRoll, PredictRoll, Trouble


class Newest(NamedTuple):
    """The newest answer, behind the values of its question."""

    values: dict[str, float]
    answer: PredictedRoll | Trouble


class Prediction:
    """Prediction for one rig's scene; `asked` is the newest question's values, `asked_at` when (monotonic)."""

    def __init__(self, computer: Computer) -> None:
        self._computer = computer
        self._scene: Scene | None = None
        self._rig: PredictRoll | None = None  # without values
        self.asked: dict[str, float] | None = None
        self.asked_at = float("-inf")
        self._lock = threading.Lock()

    def show_for(self, scene: Scene, limits: dict[str, float]) -> None:
        """Set the rig that the questions are about; questions about another one are forgotten."""
        with self._lock:
            if self._rig is None or scene is not self._scene or limits != self._rig.limits:
                self._scene, self._rig, self.asked = scene, PredictRoll(as_tables(scene), {}, limits), None
                self._computer.forget()

    def ask(self, values: dict[str, float]) -> None:
        """Ask what these values would do. Never blocks; the set itself does not wait for the answer."""
        with self._lock:
            if (rig := self._rig) is not None:
                self.asked, self.asked_at = values, time.monotonic()
                self._computer.ask(PredictRoll(rig.scene, values, rig.limits))

    def ask_again(self) -> None:
        """Ask the newest question anew where its answer is trouble that passes."""
        with self._lock:  # so that it takes the place of no newer question
            newest, rig = self.newest, self._rig
            if rig is None or newest is None or newest.values is not self.asked or self._computer.busy:
                return
            if isinstance(newest.answer, Trouble) and newest.answer.passes:
                self._computer.ask(PredictRoll(rig.scene, newest.values, rig.limits))

    @property
    def newest(self) -> Newest | None:
        """The newest answer; None while there is none."""
        newest = self._computer.newest
        if newest is None:
            return None
        question, answer = newest
        assert isinstance(question, PredictRoll)
        assert isinstance(answer, PredictedRoll | Trouble)
        if self._rig is None or question.scene is not self._rig.scene or question.limits != self._rig.limits:
            return None
        return Newest(question.values, answer)
