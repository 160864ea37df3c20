"""One parameter on the page: its readback in large, and a slider that asks for another value.

The slider belongs to whoever holds it: while a request is unanswered it stays where it was put. Then it stands at what
was accepted and waits for the stick to be above the head, at any other time at the readback.
"""

import math

import viser

from drumstick.scenes.table import Parameter, Refusal
from protocol.messages import Readback
from web_panel.access.client_message import ClientMessages, is_number, sent_to
from web_panel.access.viser_access import control_id
from web_panel.controls.slider_position import SliderPosition
from web_panel.page import markup
from web_panel.page.wording import hint_of, measured
from web_panel.rig.answer import Answer
from web_panel.tuning.changes import Changes
from web_panel.tuning.slider_range import SliderRange, range_around


class Control:
    """Made and shown by the main thread; `_moved` runs in viser's. `folder` is where on the page it stands."""

    def __init__(
        self,
        server: viser.ViserServer,
        folder: viser.GuiFolderHandle,
        messages: ClientMessages,
        changes: Changes,
        parameter: Parameter,
        scene_value: float,
        large: bool,
    ) -> None:
        self.parameter = parameter
        self._server = server
        self._folder = folder
        self._messages = messages
        self._changes = changes
        self._large = large
        self._reason = ""
        self._reason_at: int | None = None  # the newest revision while it was told
        self._asked: float | None = None
        self._content = markup.control(parameter, None, "", large)
        with folder:
            self._words = server.gui.add_html(self._content)
        travel = range_around(parameter.quantity, scene_value)
        at_first = scene_value if math.isfinite(scene_value) else travel.low
        self._travel, self._slider = travel, self._new_slider(travel, at_first)

    def _new_slider(self, travel: SliderRange, value: float) -> SliderPosition:
        with self._folder:
            slider = self._server.gui.add_slider(
                self.parameter.quantity.symbol or self.parameter.name,
                travel.low_position,
                travel.high_position,
                travel.step,
                travel.position(value),
                marks=travel.marks(),
                hint=hint_of(self.parameter),
                order=self._words.order + 0.5,
            )
        made = SliderPosition(slider)
        slider.on_update(self._moved)
        self._messages.controls[control_id(slider)] = is_number
        return made

    def forget(self) -> None:
        """Take nothing more from browsers; whoever removes the folder removes the rest."""
        del self._messages.controls[control_id(self._slider.handle)]

    async def _moved(self, event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
        if event.client is None:
            return  # the readback moved it, not a technician
        # Not the handle's value: the main thread may have moved it back to the readback since the browser moved it.
        travel, position = self._travel, sent_to(control_id(event.target), event.target.value)
        # A browser's slider cannot leave its travel, but a program at the websocket can.
        inside = travel.low_position - 1e-9 <= position <= travel.high_position + 1e-9
        value = travel.value(position) if inside else position
        self._asked = value
        self._slider.note()
        try:
            checked = self.parameter.check(value)
        except Refusal as refusal:
            self._changes.refuse(self.parameter.name, value, str(refusal))
            return
        if inside:
            self._changes.want_one(self.parameter.name, checked, event.client_id)
        else:
            self._changes.refuse(self.parameter.name, value, "that position is off the slider")

    def note_answer(self, value: float, answer: Answer) -> None:
        """Take the answer to the request for `value`; a newer request may be under way."""
        self._reason, self._reason_at = (
            answer.words_about(measured(value, self.parameter.quantity.unit)),
            None,
        )
        if self._asked == value:
            self._asked = None

    def show(
        self,
        readback: Readback | None,
        setpoint: Readback | None,
        revision: int,
        accepted: tuple[float, float] | None = None,
    ) -> None:
        """Write what changed to the page; `setpoint`: accepted, but not taken by the servo yet. `accepted`: lowest and
        highest value that the envelope would accept; None where it accepts all.

        `revision`: the newest of all values. When it moves on, a refusal is about what was then, and goes.
        """
        if self._reason_at is None:
            self._reason_at = revision
        elif revision != self._reason_at:
            self._reason = ""
        asked = self._asked
        if asked is None and setpoint is not None:
            asked = setpoint.value
        if self._asked is None and readback is not None:
            self._stand_at(readback.value if asked is None else asked)
        content = markup.control(
            self.parameter, readback, self._reason, self._large, asked, waits=setpoint is not None
        )
        if accepted is not None:
            content += markup.barred(self.parameter.name, self._travel.closed(*accepted))
        if content != self._content:
            self._content = self._words.content = content

    def _stand_at(self, value: float) -> None:
        travel = self._travel.including(value, self.parameter.quantity)
        if travel != self._travel:
            self.forget()
            self._slider.handle.remove()
            self._travel, self._slider = travel, self._new_slider(travel, value)
        self._slider.stand_at(travel.position(value), 1e-3 * travel.step)
