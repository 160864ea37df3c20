"""Theory for the plots, computed in another process, anew when a value has changed. Main thread."""

import math
from typing import Any, NamedTuple

import numpy as np

from drumstick.scenes.scene_text import as_tables
from web_panel.computing.computer import Computer
from web_panel.computing.computing_messages import Curve, FindTheory, Question, Ticks, TimeTicks, Trouble
from web_panel.computing.computing_messages import Theory as TheoryMessage
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_data import Pair

_Of = tuple[int, tuple[tuple[str, float], ...]]  # which scene, and the servo's values


_NONE: Pair = (np.empty(0), np.empty(0))


class Theory(NamedTuple):
    """Pairs of (n,): the cycle's way up and down (z in mm, v in m/s), the return map, the stable rolls (m/s).

    `missing` says why there are none; it is empty where they are. True `passes`: there may be some when asked again.
    `ends`: which stable ends there are, in words.
    """

    rising: Pair = _NONE
    falling: Pair = _NONE
    mapped: Pair = _NONE
    stable: Pair = _NONE
    missing: str = ""
    passes: bool = False
    ends: str = ""


def _pair(curve: Curve) -> Pair:
    return np.array(curve[0], np.float64), np.array(curve[1], np.float64)


def _theory(message: TheoryMessage | Trouble) -> Theory:
    if isinstance(message, Trouble):
        return Theory(missing=f"No prediction here: {message.why}", passes=message.passes)
    return Theory(
        _pair(message.rising),
        _pair(message.falling),
        _pair(message.mapped),
        _pair(message.stable),
        ends=message.ends,
    )


class TheoryClient:
    """Keeps the newest theory; while another is computed, the old one is not shown as if it still held."""

    def __init__(self, computer: Computer) -> None:
        self._computer = computer
        self._asked: tuple[Question, Any] | None = None
        self._theory: tuple[_Of, Theory] | None = None
        self._ticks: tuple[int, Ticks | Trouble] | None = None

    def theory(self, rig_state: RigState) -> Theory | None:
        """Theory of the values in use now; None while it is not known."""
        if rig_state.scene is None or len(rig_state.readbacks) < len(rig_state.table):
            return None
        used = {name: readback.value for name, readback in rig_state.readbacks.items()}
        values = tuple(sorted((name, value) for name, value in used.items() if math.isfinite(value)))
        wanted = (rig_state.scenes_seen, values)
        self._take()
        found = self._theory[1] if self._theory is not None and self._theory[0] == wanted else None
        if (found is None or found.passes) and not self._computer.busy:
            self._ask(FindTheory(as_tables(rig_state.scene), dict(values)), wanted)
        return found

    def ticks(self, rig_state: RigState) -> Ticks | Trouble | None:
        """Cost of a tick on this machine with each effect, of the scene as it stands; None while it is measured."""
        if rig_state.scene is None:
            return None
        self._take()
        found = (
            self._ticks[1] if self._ticks is not None and self._ticks[0] == rig_state.scenes_seen else None
        )
        if (found is None or (isinstance(found, Trouble) and found.passes)) and not self._computer.busy:
            self._ask(TimeTicks(as_tables(rig_state.scene)), rig_state.scenes_seen)
        return found

    def _ask(self, question: Question, of: Any) -> None:
        self._asked = question, of
        self._computer.ask(question)

    def _take(self) -> None:
        newest = self._computer.newest
        if newest is None or self._asked is None or newest.question is not self._asked[0]:
            return
        (question, of), self._asked = self._asked, None
        answer = newest.answer
        if isinstance(question, TimeTicks):
            assert isinstance(answer, Ticks | Trouble)
            self._ticks = of, answer
        else:
            assert isinstance(answer, TheoryMessage | Trouble)
            self._theory = of, _theory(answer)
