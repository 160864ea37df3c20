"""Presets on the page: choose one and load it, or save the present values under a name."""

import asyncio
import queue
from collections.abc import Callable
from typing import NamedTuple

import viser

from protocol.keys import command
from web_panel.access.client_message import ClientMessages, is_click, is_short_text
from web_panel.access.viser_access import control_id
from web_panel.page import markup
from web_panel.page.wording import chosen_elsewhere
from web_panel.rig.answer import Answer
from web_panel.rig.rig_state import RigState

_MAX_SHOWN = 40  # buttons; the command shows the rest
_MAX_NAME = 60


class PresetActions(NamedTuple):
    """Requests to the haptic server, on a thread that may wait: by a preset's name, and the browser that loads."""

    load: Callable[[str, int | None], Answer]
    save: Callable[[str], Answer]


def _is_name(value: object) -> bool:
    return is_short_text(value, _MAX_NAME)


class PresetPanel:
    """Made and shown by the main thread; `_load` and `_save` run in viser's event loop and wait on another."""

    def __init__(
        self,
        server: viser.ViserServer,
        messages: ClientMessages,
        actions: PresetActions,
        rig: str,
        order: float,
    ) -> None:
        self._server, self._messages, self._actions, self._rig = server, messages, actions, rig
        self._outcomes: queue.SimpleQueue[tuple[str, bool]] = queue.SimpleQueue()
        self._listed: tuple[str, ...] = ()
        self._names: viser.GuiButtonGroupHandle | None = None
        self._chosen = ""
        self._chosen_by: int | None = None  # a browser's id
        self._folder = server.gui.add_folder("Presets", order=order, expand_by_default=False)
        self._title_words = markup.line("No presets yet.", "presets")
        with self._folder:
            self._title = server.gui.add_html(self._title_words, order=1.0)
            self._loading = server.gui.add_button("Load preset", order=3.0, disabled=True)
            self._name = server.gui.add_text(
                "Name", "", hint="1 to 60 letters, digits, spaces, _ . or -", order=4.0
            )
            self._saving = server.gui.add_button("Save preset", order=5.0)
            self._words = server.gui.add_html(markup.line("", "preset", lines=2), order=6.0)
        messages.controls[control_id(self._loading)] = is_click
        messages.controls[control_id(self._name)] = _is_name
        messages.controls[control_id(self._saving)] = is_click
        self._loading.on_click(self._load)
        self._saving.on_click(self._save)

    async def _choose(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._chosen, self._chosen_by = event.target.value, event.client_id
        self._outcomes.put((f"{self._chosen}: chosen, not loaded yet", False))

    async def _load(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name = self._chosen
        if self._chosen_by != event.client_id:
            self._outcomes.put((chosen_elsewhere(name), True))
            return
        answer = await asyncio.to_thread(self._actions.load, name, event.client_id)
        self._outcomes.put((answer.words or f"{name}: loaded", not answer.taken))

    async def _save(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name = self._name.value.strip()
        answer = await asyncio.to_thread(self._actions.save, name)
        self._outcomes.put((answer.words or f"{name}: saved", not answer.taken))

    def show(self, rig_state: RigState) -> None:
        """Write what changed to the page."""
        while not self._outcomes.empty():
            words, alarm = self._outcomes.get()
            self._words.content = markup.line(words, "preset", alarm, lines=2)
        if rig_state.presets != self._listed:
            self._listed = rig_state.presets
            self._show_names(rig_state.presets[:_MAX_SHOWN])
        title = self._title_words + markup.chosen(self._chosen)
        if title != self._title.content:
            self._title.content = title
        self._loading.disabled = self._chosen not in self._listed

    def _show_names(self, names: tuple[str, ...]) -> None:
        if self._names is not None:
            del self._messages.controls[control_id(self._names)]
            self._names.remove()
            self._names = None
        more = len(self._listed) - len(names)
        hidden = f" {more} more: {command('preset list', self._rig)}" if more else ""
        self._title_words = markup.line(hidden if names else "No presets yet.", "presets")
        if not names:
            return
        with self._folder:
            # Not a drop-down: on a touch screen, opening one scrolls the whole panel to its top.
            self._names = self._server.gui.add_button_group("Preset", names, order=2.0)
        self._messages.controls[control_id(self._names)] = lambda value: value in names
        self._names.on_click(self._choose)
