"""The lock of the tuning on the page: take the writer's lease for this browser, or release it."""

import viser

from web_panel.access.client_message import ClientMessages, is_click, is_short_text
from web_panel.access.lease_access import LeaseAccess
from web_panel.access.viser_access import control_id
from web_panel.page import markup

_MAX_NAME = 40
_WORDS = (
    "While tuning is locked to you, changes from anywhere else are refused: other browsers, OSC, commands. "
    "PANIC and strikes work for everybody. The lock ends when you unlock it or close this page."
)


def _is_name(value: object) -> bool:
    return is_short_text(value, _MAX_NAME)


class LeaseFolder:
    """Made and shown by the main thread; clicks come on viser's."""

    def __init__(
        self, server: viser.ViserServer, messages: ClientMessages, lease: LeaseAccess, order: float
    ) -> None:
        self._lease = lease
        gui = server.gui
        with gui.add_folder("Lock tuning", order=order, expand_by_default=False):
            gui.add_html(markup.line(_WORDS, "lease-help"))
            self._name = gui.add_text("Your name", "technician", hint="Shown to everybody who is refused")
            take = gui.add_button("Lock to me")
            give = gui.add_button("Unlock")
            self._words = gui.add_html(markup.line("", "lease-answer", lines=2))
        messages.controls[control_id(self._name)] = _is_name
        for button, act in ((take, self._take), (give, self._give)):
            messages.controls[control_id(button)] = is_click
            button.on_click(act)
        self._said = ""
        server.on_client_disconnect(self._gone)

    async def _take(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if event.client_id is not None:
            self._lease.take(event.client_id, self._name.value.strip() or "technician")

    async def _give(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if event.client_id is not None:
            self._lease.give_back(event.client_id)

    async def _gone(self, client: viser.ClientHandle) -> None:
        self._lease.give_back(client.client_id)

    def show(self) -> None:
        """Write what the haptic server answered."""
        while not self._lease.outcomes.empty():
            words, alarm = self._lease.outcomes.get()
            if words != self._said:
                self._said = words
                self._words.content = markup.line(words, "lease-answer", alarm, lines=2)

    def notice(self, lease_of: str) -> str:
        """Notice of who holds the lock, for everybody; "" when nobody does."""
        if not lease_of:
            return ""
        if lease_of == self._lease.name:
            return f"Locked by {lease_of}, from a browser at this panel: others are refused."
        return f"Locked by {lease_of}: others are refused."
