"""Presets on the page: choose one, and load, rename or delete it; or save the present values under a name."""

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
_ASKS_FOR_S = 30.0
_DELETE, _KEEP, _SURE = "Delete preset", "Keep preset", "Delete for good"


class PresetActions(NamedTuple):
    """Requests to the haptic server, on a thread that may wait: by a preset's name, and the browser that asks."""

    load: Callable[[str, int | None], Answer]
    save: Callable[[str], Answer]
    rename: Callable[[str, str, int | None], Answer]  # the new name is the second
    delete: Callable[[str, int | None], Answer]


def _is_name(value: object) -> bool:
    return is_short_text(value, _MAX_NAME)


class PresetPanel:
    """Made and shown by the main thread; what a click does runs in viser's event loop and waits on another thread.

    To delete takes two buttons, for a click too many must not: the first asks, and pressed again it keeps the preset,
    as half a minute without an answer does. Both are there always, so that nothing moves.
    """

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
        self._doomed = ""  # the preset that is to be deleted, if that is confirmed
        self._asked = ""  # the one that the page shows the question about
        self._asked_until = 0.0
        self._folder = server.gui.add_folder("Presets", order=order, expand_by_default=False)
        self._title_words = markup.line("No presets yet.", "presets")
        with self._folder:
            self._title = server.gui.add_html(self._title_words, order=1.0)
            self._loading = server.gui.add_button("Load preset", order=3.0, disabled=True)
            self._name = server.gui.add_text(
                "Name", "", hint="1 to 60 letters, digits, spaces, _ . or -", order=4.0
            )
            self._saving = server.gui.add_button("Save preset", order=5.0)
            self._renaming = server.gui.add_button(
                "Rename preset", hint="Gives the chosen preset the name above", order=6.0, disabled=True
            )
            self._deleting = server.gui.add_button(
                _DELETE, hint="Asks first; pressed again, it keeps the preset", order=7.0, disabled=True
            )
            self._confirming = server.gui.add_button(_SURE, order=8.0, disabled=True)
            self._words = server.gui.add_html(markup.line("", "preset", lines=2), order=9.0)
        messages.controls[control_id(self._name)] = _is_name
        for button, act in (
            (self._loading, self._load),
            (self._saving, self._save),
            (self._renaming, self._rename),
            (self._deleting, self._ask_or_keep),
            (self._confirming, self._delete),
        ):
            messages.controls[control_id(button)] = is_click
            button.on_click(act)

    async def _choose(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._doomed = ""
        self._chosen, self._chosen_by = event.target.value, event.client_id
        self._outcomes.put((f"{self._chosen}: chosen", False))

    def _is_chosen_here(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> bool:
        if self._chosen_by != event.client_id:
            self._outcomes.put((chosen_elsewhere(self._chosen), True))
        return self._chosen_by == event.client_id

    async def _load(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name, self._doomed = self._chosen, ""
        if self._is_chosen_here(event):
            self._say(f"{name}: loaded", await asyncio.to_thread(self._actions.load, name, event.client_id))

    async def _save(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name, self._doomed = self._name.value.strip(), ""
        self._say(f"{name}: saved", await asyncio.to_thread(self._actions.save, name))

    async def _rename(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name, new, self._doomed = self._chosen, self._name.value.strip(), ""
        if not self._is_chosen_here(event):
            return
        answer = await asyncio.to_thread(self._actions.rename, name, new, event.client_id)
        if answer.taken and self._chosen == name:
            self._chosen = new
        self._say(f"{name}: now called {new}", answer)

    async def _ask_or_keep(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if not self._is_chosen_here(event):
            return
        kept, self._doomed = self._doomed, "" if self._doomed else self._chosen
        question = f"Delete {self._doomed} for good? Press “{_SURE}”, or “{_KEEP}”."
        self._outcomes.put((question, True) if self._doomed else (f"{kept}: kept", False))

    async def _delete(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        name = self._doomed
        if not name or not self._is_chosen_here(event):
            return
        self._doomed = ""
        answer = await asyncio.to_thread(self._actions.delete, name, event.client_id)
        if answer.taken and self._chosen == name:
            self._chosen = ""
        self._say(f"{name}: deleted", answer)

    def _say(self, done: str, answer: Answer) -> None:
        self._outcomes.put((answer.words or done, not answer.taken))

    def _keep_unanswered(self, now: float) -> None:
        doomed = self._doomed
        if doomed != self._asked:
            self._asked, self._asked_until = doomed, now + _ASKS_FOR_S
        elif doomed and now >= self._asked_until:
            self._doomed = self._asked = ""
            self._outcomes.put((f"{doomed}: kept, as nothing was pressed for {_ASKS_FOR_S:.0f} s", True))

    def show(self, rig_state: RigState, now: float) -> None:
        """Write what changed to the page. `now`: seconds of a clock that never goes back."""
        self._keep_unanswered(now)
        while not self._outcomes.empty():
            words, alarm = self._outcomes.get()
            self._words.content = markup.line(words, "preset", alarm, lines=2)
        if rig_state.presets != self._listed:
            self._listed = rig_state.presets
            self._doomed = ""  # the name may be another's now, and the buttons may have moved
            self._show_names(rig_state.presets[:_MAX_SHOWN])
        title = self._title_words + markup.chosen(self._chosen)
        if title != self._title.content:
            self._title.content = title
        doomed = self._doomed
        self._deleting.label = _KEEP if doomed else _DELETE
        self._confirming.disabled = not doomed
        for button in (self._loading, self._renaming, self._deleting):
            button.disabled = self._chosen not in self._listed

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
