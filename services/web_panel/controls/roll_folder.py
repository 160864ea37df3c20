"""Rate and level of the roll on the page: two sliders and a picture of what is within reach, where a scene rolls."""

import math

import viser

from drumstick.analysis.unpulsed import why_no_roll
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from web_panel.access.client_message import ClientMessages, is_number, sent_to
from web_panel.access.viser_access import control_id
from web_panel.computing.computer import Computer
from web_panel.computing.computing_messages import FindReach, Reach, Trouble
from web_panel.computing.reach import FASTEST_HZ, SLOWEST_HZ
from web_panel.controls.slider_position import SliderPosition
from web_panel.page import markup
from web_panel.page.reach_picture import closed_levels, closed_rates, reach_picture
from web_panel.rig.rig_state import RigState
from web_panel.tuning.changes import Changes

_RATES = (2, 5, 10, 20, 50, 100)
_STILL_S = 0.5  # a picture is half a second of computing: not while a slider or a ramp moves values
_HELD_S = 1.0  # a slider that was moved stays there until its answer can have come
_HINTS = {
    "rate": "Strokes a second, at the level that the roll has: moves k_hand and dv_pls. OSC: /drumstick/play/rate",
    "level": "How loud, 0 .. 1, at the rate that the roll has: moves z_ss and dv_pls. OSC: /drumstick/play/level",
}


class RollFolder:
    """Made and shown by the main thread; `_moved` runs in viser's."""

    def __init__(
        self,
        server: viser.ViserServer,
        messages: ClientMessages,
        changes: Changes,
        computer: Computer,
        order: float,
    ) -> None:
        self._changes, self._computer = changes, computer
        self._scene: Scene | None = None
        self._asked: FindReach | None = None
        self._reach: Reach | None = None
        self._values: dict[str, float] = {}
        self._still_since = float("-inf")
        self._held_until = dict.fromkeys(_HINTS, float("-inf"))
        self._now = 0.0
        gui = server.gui
        self._folder = gui.add_folder("Rate and level", order=order, visible=False)
        low, high = math.log10(SLOWEST_HZ), math.log10(FASTEST_HZ)
        with self._folder:
            self._picture = gui.add_html("")
            self._rate_words = gui.add_html("")
            rate = gui.add_slider(
                "Rate of the roll", low, high, 0.005, math.log10(20.0),
                marks=tuple((math.log10(each), f"{each}") for each in _RATES), hint=_HINTS["rate"],
            )  # fmt: skip
            self._level_words = gui.add_html("")
            level = gui.add_slider(
                "Level of the roll", 0.0, 1.0, 0.005, 0.3,
                marks=((0.0, "0"), (0.5, "0.5"), (1.0, "1")), hint=_HINTS["level"],
            )  # fmt: skip
            self._note = gui.add_html("")
        self._sliders = {"rate": SliderPosition(rate), "level": SliderPosition(level)}
        for slider in (rate, level):
            slider.on_update(self._moved)
            messages.controls[control_id(slider)] = is_number

    async def _moved(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is None:
            return  # what holds moved it, not a technician
        name = "rate" if event.target is self._sliders["rate"].handle else "level"
        position = sent_to(control_id(event.target), event.target.value)
        self._held_until[name] = self._now + _HELD_S
        self._sliders[name].note()
        value = 10.0 ** min(position, math.log10(FASTEST_HZ)) if name == "rate" else position
        self._changes.want_roll(name, float(f"{value:.4g}"), event.client_id)

    def show(self, rig_state: RigState, is_seen: bool, now: float) -> None:
        """Write what changed to the page, and ask for the picture anew when values have changed."""
        self._now = now
        scene = rig_state.scene
        rolls = scene is not None and not why_no_roll(scene)
        if self._folder.visible != rolls:
            self._folder.visible = rolls
        if scene is None or not rolls or not is_seen:
            return
        if scene is not self._scene:
            self._scene, self._reach, self._asked = scene, None, None
        self._ask(scene, rig_state, now)
        reach, plays = self._reach, rig_state.plays(now)
        told = (
            {"rate": reach.rate_Hz, "level": reach.level}
            if reach is not None
            else {"rate": 0.0, "level": 0.0}
        )
        told |= rig_state.roll
        rate, level = (f"{told['rate']:.1f}", f"{told['level']:.2f}") if told["rate"] > 0.0 else ("–", "–")
        may_move = reach is not None and not reach.why and told["rate"] > 0.0
        rates = closed_rates(reach, told["level"]) if reach is not None and may_move else (0.0, 0.0)
        levels = closed_levels(reach, told["rate"]) if reach is not None and may_move else (0.0, 0.0)
        contents = [
            reach_picture(reach, told["rate"], told["level"], plays),
            markup.named("rate", "Rate of the roll", _HINTS["rate"], rate, "Hz", "log", old=not plays)
            + markup.barred("rate", rates),
            markup.named("level", "Level of the roll", _HINTS["level"], level, old=not plays)
            + markup.barred("level", levels),
            markup.line(self._changes.roll_words, "roll", alarm=True, lines=2),
        ]
        for handle, content in zip(
            (self._picture, self._rate_words, self._level_words, self._note), contents, strict=True
        ):
            if handle.content != content:
                handle.content = content
        if told["rate"] <= 0.0:
            return  # no roll: nothing to stand at
        self._stand_at("rate", math.log10(min(max(told["rate"], SLOWEST_HZ), FASTEST_HZ)), now)
        self._stand_at("level", min(max(told["level"], 0.0), 1.0), now)

    def _stand_at(self, name: str, position: float, now: float) -> None:
        if now > self._held_until[name]:
            self._sliders[name].stand_at(position, 1e-3)

    def _ask(self, scene: Scene, rig_state: RigState, now: float) -> None:
        newest = self._computer.newest
        if newest is not None and newest.question is self._asked:
            answer = newest.answer
            self._reach = answer if isinstance(answer, Reach) else Reach(why="it cannot be computed")
            if isinstance(answer, Trouble) and answer.passes:
                self._asked = None  # again, when the computer is free
        values = {n: r.value for n, r in rig_state.readbacks.items() if math.isfinite(r.value)}
        if values != self._values:
            self._values, self._still_since = values, now
        still = self._reach is None or now - self._still_since >= _STILL_S
        if not still or self._computer.busy or len(rig_state.readbacks) < len(rig_state.table):
            return
        question = FindReach(as_tables(scene), values, rig_state.limits)
        if question != self._asked:
            self._asked = question
            self._computer.ask(question)
