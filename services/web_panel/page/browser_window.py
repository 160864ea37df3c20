"""Room in one browser's window: for the controls alone (phone, tablet), with the picture, or with plots as well.

viser tells a size in dots of the screen, and not whether a style hides the picture. So the page's script presses one
of four buttons that nobody sees, until the panel has heard it.
"""

import viser

from web_panel.access.client_message import ClientMessages
from web_panel.access.viser_access import control_id
from web_panel.page import markup
from web_panel.page.picture_camera import camera_for
from web_panel.rig.stick_shape import Point

WIDTH_PX = 600.0  # of the controls beside the picture
PHONE, TABLET, DESK, WIDE = "phone", "tablet", "desk", "wide"
_ROOMS = (PHONE, TABLET, DESK, WIDE)


class BrowserWindow:
    """Follows one window. Main thread, but for `_note`, which runs in viser's and only notes the room."""

    def __init__(self, client: viser.ClientHandle, messages: ClientMessages, order: float) -> None:
        self._client, self._messages = client, messages
        self._told = self._room = ""
        self._camera: tuple[Point, Point] | None = None
        self._mark = client.gui.add_html(markup.room(""), order=order)
        self._buttons = client.gui.add_button_group("Room", _ROOMS, order=order + 0.01)
        messages.controls[control_id(self._buttons)] = lambda value: value in _ROOMS
        self._buttons.on_click(self._note)

    async def _note(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        self._told = event.target.value

    @property
    def has_picture(self) -> bool:
        """True where the picture is in view."""
        return self._room in (DESK, WIDE)

    @property
    def is_wide(self) -> bool:
        """True where plots stand beside controls and picture."""
        return self._room == WIDE

    def follow(self, radius_m: float | None) -> None:
        """Take what the window was told to be, and let drum and stick be seen whole; the head's radius, once known."""
        if self._told != self._room:
            if self._room == PHONE:
                self._client.gui.main_panel.set_width(WIDTH_PX)  # which viser forgets on a phone
            self._room = self._told
        camera = self._client.camera
        if radius_m is None or not self.has_picture or min(camera.image_width, camera.image_height) < 2:
            return
        wanted = camera_for(camera.image_width / camera.image_height, radius_m)
        if wanted != self._camera:
            self._camera = wanted
            camera.position, camera.look_at = wanted

    def confirm(self) -> None:
        """Tell the page that all stands as its window has room for."""
        content = markup.room(self._room)
        if content != self._mark.content:
            self._mark.content = content

    def forget(self) -> None:
        """The browser has gone."""
        self._messages.controls.pop(control_id(self._buttons), None)
