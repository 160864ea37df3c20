"""The whole page, from top to bottom: PANIC, condition, three numbers, the two main controls, the rest, a view."""

from collections.abc import Callable
from typing import NamedTuple

import viser

from web_panel.access.client_message import ClientMessages, is_click
from web_panel.access.lan_listener import Lan
from web_panel.access.lease_access import LeaseAccess
from web_panel.access.viser_access import control_id
from web_panel.controls.keyboard import add_key
from web_panel.controls.lease_folder import LeaseFolder
from web_panel.controls.phone_folder import PhoneFolder
from web_panel.controls.prediction_line import PredictionLine
from web_panel.controls.preset_panel import PresetActions, PresetPanel
from web_panel.controls.roll_folder import RollFolder
from web_panel.controls.scene_folder import SceneFolder
from web_panel.controls.steps_row import StepsRow
from web_panel.controls.tuning import Tuning
from web_panel.page import markup
from web_panel.page.browser_window import WIDTH_PX
from web_panel.page.drum_view import DrumView
from web_panel.page.pad import pad
from web_panel.page.strike_pad import strike_pad
from web_panel.page.style import MARK_PANIC
from web_panel.page.wording import limited_words, notice_of, output_words, sound_words
from web_panel.rig.answer import Answer
from web_panel.rig.rig_state import RigState
from web_panel.tuning.changes import Changes
from web_panel.tuning.panic import Panic
from web_panel.tuning.prediction import Prediction
from web_panel.views.view_choice import Sources, Views

_ORDER_PAD, _ORDER_PREDICTION = 9.0, 9.5
_ORDER_TUNING, _ORDER_STEPS, _ORDER_PRESETS, _ORDER_LEASE, _ORDER_SCENE = 10.0, 12.0, 15.0, 16.0, 17.0
_ORDER_ROLL, _ORDER_STRIKE_PAD = 11.0, 14.0
_ORDER_PHONE = 18.0
_ORDER_HEALTH, _ORDER_MORE, _ORDER_VIEWS = 30.0, 40.0, 50.0
_HEADINGS = {
    8.9: "Playing and tuning",
    13.9: "Striking the drum",
    14.9: "Presets, lock and scenes",
    29.9: "State of the rig",
    39.9: "All parameters",
    49.9: "Views",
}
_PANIC_HINT = (
    "Cuts all force now, until `drumstick arm` at the haptic machine (a reboot of it, or a new `drumstick up`, "
    "`drumstick haptic` or container, also gives it back). A network and a browser stand between this button and the "
    "stick: it is no substitute for the switch at the device."
)


class RigActions(NamedTuple):
    """Requests to the rig by buttons; each waits for its answer, on a thread that it may block."""

    panic: Callable[[], Answer]
    presets: PresetActions
    load_scene: Callable[[str, int | None], Answer]


class Page:
    """Made and shown by the main thread."""

    def __init__(
        self,
        server: viser.ViserServer,
        messages: ClientMessages,
        changes: Changes,
        actions: RigActions,
        lease: LeaseAccess,
        prediction: Prediction,
        sources: Sources,
        rig: str,
    ) -> None:
        self._server, self._messages, self._changes = server, messages, changes
        self._panic = Panic(actions.panic)
        self._rig = rig
        self._scene_shown = 0
        self._tuning: Tuning | None = None
        gui = server.gui
        gui.configure_theme(
            dark_mode=True, show_logo=False, show_share_button=False, brand_color=(56, 163, 224)
        )
        gui.set_panel_label(f"Drumstick: {rig}")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH_PX)
        gui.add_html(markup.style(rig))
        self._beat = Text(gui.add_html(""))
        gui.add_html(MARK_PANIC)  # before all that has words: nothing above it can move it
        button = gui.add_button("PANIC", color="red", hint=_PANIC_HINT)
        messages.controls[control_id(button)] = is_click
        button.on_click(self._panic.press)
        add_key(
            server,
            messages,
            "Panic",
            "Cut all force now, until `drumstick arm` (or a reboot, or a new `drumstick up` or `haptic`)",
            "escape",
            None,
            self._panic.press,
        )
        self._notice = Text(gui.add_html(""))
        self._tiles = Text(gui.add_html(""))
        self._pad = Text(gui.add_html("", order=_ORDER_PAD))
        self._absent = Text(gui.add_html("", order=_ORDER_TUNING))
        self._roll = RollFolder(server, messages, changes, sources.computer, _ORDER_ROLL)
        self._steps = StepsRow(server, messages, changes, _ORDER_STEPS)
        gui.add_html(strike_pad(), order=_ORDER_STRIKE_PAD)
        self._preset_panel = PresetPanel(server, messages, actions.presets, rig, _ORDER_PRESETS)
        self._lease_folder = LeaseFolder(server, messages, lease, _ORDER_LEASE)
        self._scene_folder = SceneFolder(server, messages, actions.load_scene, _ORDER_SCENE)
        self._phone_folder: PhoneFolder | None = None
        self._prediction_line = PredictionLine(server, prediction, _ORDER_PREDICTION)
        for order, words in _HEADINGS.items():
            gui.add_html(markup.heading(words), order=order)
        self._health = Text(gui.add_html("", order=_ORDER_HEALTH))
        self._drum = DrumView(server)
        self.views = Views(server, messages, sources, _ORDER_VIEWS)

    def add_phones(self, lan: Lan) -> None:
        """Show what is open to the network, and how a phone comes in. Before anybody visits."""
        self._phone_folder = PhoneFolder(self._server, self._messages, lan, _ORDER_PHONE)

    def show(self, rig_state: RigState, now: float) -> None:
        """Write what changed since the last call."""
        self._beat.say(markup.beat(int(now)))
        silence = rig_state.silent_s(now)
        old = silence is None or silence > 0.0
        self._prediction_line.show(rig_state, bool(self._server.get_clients()), now)
        no_roll = self._prediction_line.no_roll
        self._tiles.say(markup.tiles(rig_state.state, rig_state.strike, old, no_roll))
        meters, too_loud = rig_state.living_meters(now), rig_state.was_limited(now)
        self._health.say(
            markup.health(
                rig_state.scene,
                rig_state.state,
                sound_words(meters),
                output_words(meters),
                limited_words(meters, too_loud),
                too_loud,
            )
        )
        self._pad.say(pad() if rig_state.pointed else "")
        if rig_state.state is not None and rig_state.state.status == "panic":
            self._panic.seen(rig_state.state_at)
        self._scene_folder.show(rig_state, now)
        if self._phone_folder is not None:
            self._phone_folder.show()
        condition = notice_of(
            rig_state.connected, rig_state.state, silence, self._rig, self._scene_folder.due
        )
        lease = self._lease_folder.notice(rig_state.lease_of)
        self._notice.say(markup.notice(condition, self._panic.line, lease))
        self._show_tuning(rig_state)
        self._lease_folder.show()
        self._roll.show(rig_state, bool(self._server.get_clients()), now)
        self._steps.show(rig_state.table, rig_state.standing())
        self._preset_panel.show(rig_state, now)
        self.views.show(rig_state, now)

    def show_picture(self, rig_state: RigState, now: float) -> None:
        """Move the picture, and note what is new for the views: oftener than the rest is written."""
        self._drum.show(rig_state, now)
        self.views.take(rig_state, now)
        rig_state.forget_news()

    def _show_tuning(self, rig_state: RigState) -> None:
        if rig_state.scene is not None and rig_state.scenes_seen != self._scene_shown:
            self._scene_shown = rig_state.scenes_seen
            if self._tuning is not None:
                self._tuning.remove()
            self._tuning = Tuning(
                self._server,
                self._messages,
                self._changes,
                rig_state.scene,
                rig_state.table,
                _ORDER_TUNING,
                _ORDER_MORE,
            )
        if self._tuning is None:
            self._absent.say(
                markup.line("The controls appear when the haptic server reports its scene.", "absent")
            )
            return
        self._absent.say("")
        self._tuning.show(rig_state, self._prediction_line.accepted)

    def note_answer(self, name: str, value: float, answer: Answer) -> None:
        """Hand the answer to a request to its control; a scene that has gone may have left some behind."""
        if self._tuning is not None and name in self._tuning.controls:
            self._tuning.controls[name].note_answer(value, answer)


class Text:
    """A piece of HTML that is sent only when it changes."""

    def __init__(self, handle: viser.GuiHtmlHandle) -> None:
        self._handle = handle
        self._content = handle.content

    def say(self, content: str) -> None:
        """Show this."""
        if content != self._content:
            self._content = self._handle.content = content
