"""Scenes on the page: choose one, or step through the set list."""

import asyncio
import queue
from collections.abc import Callable

import viser

from drumstick.scenes.scene_text import shipped_names
from web_panel.access.client_message import ClientMessages, is_click
from web_panel.access.viser_access import control_id
from web_panel.page import markup
from web_panel.page.wording import chosen_elsewhere
from web_panel.rig.answer import Answer
from web_panel.rig.rig_state import RigState
from web_panel.rig.scene_change import SceneChange

_WORDS = (
    "The next scene is made ready while this one plays on, some seconds or longer. Then the stick pauses for a moment. "
    "Your last values for each scene are kept."
)
_PREVIOUS, _NEXT = "Previous", "Next"  # in small letters they are what is asked for


class SceneFolder:
    """Made and shown by the main thread; clicks come on viser's. `load(name, browser)` asks and waits."""

    def __init__(
        self,
        server: viser.ViserServer,
        messages: ClientMessages,
        load: Callable[[str, int | None], Answer],
        order: float,
    ) -> None:
        self._load = load
        self._outcomes: queue.SimpleQueue[tuple[str, bool]] = queue.SimpleQueue()
        self._agreed: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._change = SceneChange()
        self._chosen = ""
        self._chosen_by: int | None = None  # a browser's id
        self._playing = ""
        names = tuple(shipped_names())
        gui = server.gui
        with gui.add_folder("Scene", order=order, expand_by_default=False):
            self._help = gui.add_html(markup.line(_WORDS, "scene-help"))
            group = gui.add_button_group("Scene", names)
            self._button = gui.add_button("Play this scene", disabled=True)
            steps = gui.add_button_group("Set list", (_PREVIOUS, _NEXT))
            self._words = gui.add_html(markup.line("", "scene-answer", lines=2))
        messages.controls[control_id(group)] = lambda value: value in names
        messages.controls[control_id(self._button)] = is_click
        messages.controls[control_id(steps)] = lambda value: value in (_PREVIOUS, _NEXT)
        group.on_click(self._choose)
        steps.on_click(self._step)
        self._button.on_click(self._play)

    async def _choose(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._chosen, self._chosen_by = event.target.value, event.client_id
        self._outcomes.put((f"{self._chosen}: chosen, not playing yet", False))

    async def _play(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name = self._chosen
        if self._chosen_by != event.client_id:
            self._outcomes.put((chosen_elsewhere(name), True))
            return
        answer = await asyncio.to_thread(self._load, name, event.client_id)
        if answer.taken:
            self._agreed.put(name)
        self._outcomes.put((answer.words or f"{name}: being made ready", not answer.taken))

    async def _step(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        answer = await asyncio.to_thread(self._load, event.target.value.lower(), event.client_id)
        self._outcomes.put((answer.words or "the set list goes on", not answer.taken))

    @property
    def due(self) -> str:
        """Name of the scene that is starting; "" while none is."""
        return self._change.asked

    def show(self, rig_state: RigState, now: float) -> None:
        """Write what changed to the page."""
        while not self._agreed.empty():
            self._change.begin(self._agreed.get(), rig_state, now)
        while not self._outcomes.empty():
            self._say(*self._outcomes.get())
        content = markup.line(_WORDS, "scene-help") + markup.chosen(self._chosen)
        if content != self._help.content:
            self._help.content = content
        if self._button.disabled == bool(self._chosen):
            self._button.disabled = not self._chosen
        playing = rig_state.scene.name if rig_state.scene is not None else ""
        if playing != self._playing:
            self._playing = playing
            self._say(f"{playing} is playing", False)
        outcome = self._change.outcome(rig_state, now)
        if outcome is not None:
            self._say(*outcome)

    def _say(self, words: str, alarm: bool) -> None:
        content = markup.line(words, "scene-answer", alarm, lines=2)
        if content != self._words.content:
            self._words.content = content
