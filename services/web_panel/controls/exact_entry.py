"""Typing an exact value, over the whole range of the table: sliders are for the hand, this is for a known number."""

import viser

from drumstick.scenes.table import Parameter, Refusal
from web_panel.access.client_message import ClientMessages, is_click, is_short_text
from web_panel.access.viser_access import control_id
from web_panel.page import markup
from web_panel.page.wording import chosen_elsewhere, measured, range_of
from web_panel.tuning.changes import Changes

_MAX_TEXT = 40


def _is_entry(value: object) -> bool:
    return is_short_text(value, _MAX_TEXT)


class ExactEntry:
    """Buttons that choose a parameter, a field, a button. Made by the main thread; `_send` runs in viser's."""

    def __init__(
        self,
        server: viser.ViserServer,
        folder: viser.GuiFolderHandle,
        messages: ClientMessages,
        changes: Changes,
        table: dict[str, Parameter],
    ) -> None:
        self._messages = messages
        self._changes = changes
        self._table = table
        self._chosen_row = next(iter(table.values()))
        self._chosen_by: int | None = None  # a browser's id
        with folder:
            self._title = server.gui.add_html("")
            # Not a drop-down: on a touch screen, opening one scrolls the whole panel to its top.
            self._names = server.gui.add_button_group("Parameter", tuple(table), hint="By its wire name")
            self._text = server.gui.add_text(
                "Value", "", hint="A number in the unit shown; decimal point, no unit"
            )
            self._words = server.gui.add_html(markup.line("", "exact", lines=2))
            self._button = server.gui.add_button("Set")
        messages.controls[control_id(self._names)] = lambda value: isinstance(value, str) and value in table
        messages.controls[control_id(self._text)] = _is_entry
        messages.controls[control_id(self._button)] = is_click
        self._button.on_click(self._send)
        self._names.on_click(self._chosen)
        self._show_range()

    def forget(self) -> None:
        """Take nothing more from browsers; whoever removes the folder removes the rest."""
        for handle in (self._names, self._text, self._button):
            del self._messages.controls[control_id(handle)]

    async def _chosen(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._chosen_row, self._chosen_by = self._table[event.target.value], event.client_id
        self._show_range()

    def _show_range(self) -> None:
        title = markup.line("Exact value, over the whole range:", "exact-title")
        self._title.content = title + markup.chosen(self._chosen_row.name)
        self._say(f"{self._chosen_row.name}: {range_of(self._chosen_row.quantity)}", alarm=False)

    async def _send(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        parameter = self._chosen_row
        if self._chosen_by not in (None, event.client_id):
            self._say(chosen_elsewhere(parameter.name), alarm=True)
            return
        try:
            value = parameter.check(float(self._text.value.strip().replace("−", "-")))
        except Refusal as refusal:
            self._say(str(refusal), alarm=True)
        except ValueError:
            self._say(f"{self._text.value!r} is not a number", alarm=True)
        else:
            self._say(f"asked for {parameter.name} = {measured(value, parameter.quantity.unit)}", alarm=False)
            self._changes.want_one(parameter.name, value, event.client_id)

    def _say(self, words: str, alarm: bool) -> None:
        self._words.content = markup.line(words, "exact", alarm, lines=2)
