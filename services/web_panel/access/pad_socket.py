"""Rules for the websockets of all pads: how many, how long a message. viser's thread; nothing here blocks.

Whoever gets here has passed web_panel.access.admission.
"""

from collections.abc import Callable
from typing import TypeVar

import msgspec
import websockets.asyncio.server as websocket_server
from websockets.exceptions import ConnectionClosed

_MAX_PADS = 16
_MAX_FRAME = 200

_F = TypeVar("_F", bound=msgspec.Struct)


def frame_of(kind: type[_F], text: object) -> _F | None:
    """The frame, or None for anything that is none."""
    if not isinstance(text, str) or len(text) > _MAX_FRAME:
        return None
    try:
        return msgspec.json.decode(text, type=kind)
    except (msgspec.MsgspecError, ValueError):
        return None


class PadSocket:
    """Serves the pads of one kind on every page."""

    def __init__(self) -> None:
        self._pads = 0

    async def serve(
        self, connection: websocket_server.ServerConnection, kind: type[_F], take: Callable[[_F], None]
    ) -> None:
        """One pad, to its end: `take` gets its frames."""
        if self._pads >= _MAX_PADS:
            await connection.close(1013, "too many pads are open")
            return
        self._pads += 1
        try:
            while True:
                frame = frame_of(kind, await connection.recv())
                if frame is not None:
                    take(frame)
        except ConnectionClosed:
            return
        finally:
            self._pads -= 1
