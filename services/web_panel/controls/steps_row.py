"""Undo and redo, and the two sets A and B, on the page."""

from collections.abc import Mapping

import viser

from drumstick.scenes.table import Parameter
from web_panel.access.client_message import ClientMessages
from web_panel.access.viser_access import control_id
from web_panel.controls.keyboard import add_key
from web_panel.page import markup
from web_panel.page.wording import measured
from web_panel.tuning.changes import Changes
from web_panel.tuning.compare import SLOTS

_UNDO, _REDO = "Undo", "Redo"
_STORE = "Store in "
_STEPS = (_UNDO, _REDO)
_SETS = (*SLOTS, *(_STORE + slot for slot in SLOTS))
_MAX_NAMED = 3


def step_words(
    values: Mapping[str, float], standing: Mapping[str, float], table: Mapping[str, Parameter]
) -> str:
    """Changes that these values would make to the present ones: `Δv_pls 0.25 → 0.2 m/s`."""
    changed = [name for name in values if name in table and standing.get(name, values[name]) != values[name]]
    shown = [
        f"{_symbol(table[n])} {measured(standing[n], '1')} → {measured(values[n], table[n].quantity.unit)}"
        for n in changed[:_MAX_NAMED]
    ]
    more = len(changed) - len(shown)
    return (", ".join(shown) + (f" and {more} more" if more else "")) or "changes nothing that holds"


def _symbol(parameter: Parameter) -> str:
    return parameter.quantity.symbol or parameter.name


def sets_words(changes: Changes, values: Mapping[str, float], table: Mapping[str, Parameter]) -> str:
    """State of the sets A and B: which is on, whether it is in force, and how they differ."""
    compare = changes.compare
    if not compare.slots:
        return "A and B are empty: store the present values in one, change them, store them in the other."
    changed = [_symbol(table[name]) for name in compare.changed(values) if name in table]
    words = f"{compare.on} is on"
    words += f", changed since: {', '.join(changed)}." if changed else ", as it was stored."
    if len(compare.slots) < len(SLOTS):
        return f"{words} {next(slot for slot in SLOTS if slot not in compare.slots)} is empty."
    differing = [_symbol(table[name]) for name in compare.differing() if name in table]
    return f"{words} A and B {'differ in ' + ', '.join(differing) if differing else 'are the same'}."


class StepsRow:
    """Made and shown by the main thread; clicks come on viser's."""

    def __init__(
        self, server: viser.ViserServer, messages: ClientMessages, changes: Changes, order: float
    ) -> None:
        self._changes = changes
        self._contents = ["", ""]
        gui = server.gui
        with gui.add_folder(None, order=order):
            self._undo_words = gui.add_html("")
            steps = gui.add_button_group("Change", _STEPS)
            self._sets_words = gui.add_html("")
            sets = gui.add_button_group("Compare", _SETS)
        messages.controls[control_id(steps)] = lambda value: value in _STEPS
        messages.controls[control_id(sets)] = lambda value: value in _SETS
        steps.on_click(self._step)
        sets.on_click(self._set)
        for label, words, key, modifier, act in (
            (_UNDO, "Take back the last change", "Z", "cmd/ctrl", changes.undo),
            (_REDO, "Do again what was undone", "Z", "cmd/ctrl+shift", changes.redo),
            ("Switch A and B", "To the set that is not on", "B", "cmd/ctrl", changes.switch_over),
        ):
            add_key(server, messages, label, words, key, modifier, act)

    async def _step(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        (self._changes.undo if event.target.value == _UNDO else self._changes.redo)(event.client_id)

    async def _set(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        asked = event.target.value
        if asked in SLOTS:
            self._changes.switch(asked, event.client_id)
        else:
            self._changes.store(asked.removeprefix(_STORE))

    def show(self, table: Mapping[str, Parameter], values: Mapping[str, float]) -> None:
        """Write what changed to the page; `values`: what was accepted last."""
        history = self._changes.history
        parts: list[str] = []
        if history.back:
            shown = step_words(history.back[-1].before, values, table)
            parts.append(f"{_UNDO} ({len(history.back)} left): {shown}")
        if history.forth:
            parts.append(f"{_REDO}: {step_words(history.forth[-1].after, values, table)}")
        words, alarm = " · ".join(parts) or "Nothing was changed on this page yet.", False
        if self._changes.words:
            words, alarm = self._changes.words, self._changes.alarm
        contents = [
            markup.line(words, "steps", alarm, lines=2),
            markup.line(sets_words(self._changes, values, table), "sets", lines=2)
            + markup.chosen(self._changes.compare.on),
        ]
        for content, before, handle in zip(
            contents, self._contents, (self._undo_words, self._sets_words), strict=True
        ):
            if content != before:
                handle.content = content
        self._contents = contents
