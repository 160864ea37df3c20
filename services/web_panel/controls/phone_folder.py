"""The page on a phone: what --panel-lan opens, and the login link as a QR code.

Only in browsers of this machine: who came in by a link cannot let others in.
"""

import math

import viser

from web_panel.access.client_message import ClientMessages, is_click
from web_panel.access.lan_listener import Lan
from web_panel.access.viser_access import control_id, is_from_lan
from web_panel.page import markup, qr_code


class PhoneFolder:
    """Made and shown by the main thread; browsers come, click and go on viser's."""

    def __init__(self, server: viser.ViserServer, messages: ClientMessages, lan: Lan, order: float) -> None:
        self._lan, self._messages, self._order = lan, messages, order
        self._shown: dict[int, tuple[viser.GuiHtmlHandle, str]] = {}  # by browser: link, and its button's id
        self._drawn = "", 0, ""  # link, minutes left, and the HTML of both
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._went)

    async def _came(self, client: viser.ClientHandle) -> None:
        if is_from_lan():
            return
        with client.gui.add_folder("Phone", order=self._order, expand_by_default=False):
            client.gui.add_html(markup.line(self._lan.words, "phone-help"))
            button = client.gui.add_button("New login link", hint="The previous link stops working")
            link = client.gui.add_html(self._link())
        self._messages.controls[control_id(button)] = is_click
        button.on_click(self._renew)
        self._shown[client.client_id] = link, control_id(button)

    async def _went(self, client: viser.ClientHandle) -> None:
        if client.client_id in self._shown:
            _, button = self._shown.pop(client.client_id)
            del self._messages.controls[button]

    async def _renew(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if not is_from_lan():
            self._lan.admission.login.renew()

    def _link(self) -> str:
        link = self._lan.admission.open_link
        if not link:
            return markup.line("No login link is valid now. To let a phone in: New login link.", "phone-link")
        minutes = math.ceil(self._lan.admission.login.left_s / 60.0)
        drawn = self._drawn  # read once: browsers come on viser's thread
        if drawn[:2] != (link, minutes):
            words = f"This link admits one browser, once, within {minutes} min: {link}"
            code = qr_code.picture(link, "QR code of the login link")
            drawn = self._drawn = link, minutes, markup.line(words, "phone-link") + code
        return drawn[2]

    def show(self) -> None:
        """Write the link, or that there is none."""
        content = self._link()
        for link, _ in list(self._shown.values()):
            if link.content != content:
                link.content = content
