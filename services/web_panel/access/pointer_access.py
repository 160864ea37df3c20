"""Messages of the pad's websocket, checked and passed on. viser's thread; nothing here blocks.

A frame is the JSON of [held, lift, x]: lift 0 pressed .. 1 lifted, x from -1 left to 1 right. A connection that ends
has let go.
"""

import secrets
import time
from collections.abc import Callable
from typing import Annotated

import msgspec
import websockets.asyncio.server as websocket_server

from protocol.messages import Pointer
from web_panel.access.pad_socket import PadSocket

PATH = "/pointer"
_MIN_APART_S = 0.004  # four times what a page sends; what comes oftener is passed over


class PointerFrame(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """Message of the pad."""

    held: bool
    lift: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
    x: Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]


class Pad:
    """One page's pad; `pointer` gives what is to be sent of a frame, or None."""

    def __init__(self) -> None:
        self._source = secrets.token_hex(8)
        self._seq = 0
        self._held = False
        self._sent_at = float("-inf")

    def pointer(self, frame: PointerFrame, now: float) -> Pointer | None:
        """A frame that presses or lets go always counts; others at most so often."""
        if frame.held == self._held and (not frame.held or now - self._sent_at < _MIN_APART_S):
            return None
        self._held, self._sent_at = frame.held, now
        self._seq += 1
        return Pointer(source=self._source, seq=self._seq, held=frame.held, lift=frame.lift, x=frame.x, y=0.0)


class PointerAccess:
    """Serves the pads of every page; `put` sends to the rig."""

    def __init__(self, put: Callable[[Pointer], None]) -> None:
        self._put = put
        self._socket = PadSocket()

    async def serve(self, connection: websocket_server.ServerConnection) -> None:
        """One pad, from its first frame to its end."""
        pad = Pad()

        def send(frame: PointerFrame) -> None:
            pointer = pad.pointer(frame, time.monotonic())
            if pointer is not None:
                self._put(pointer)

        try:
            await self._socket.serve(connection, PointerFrame, send)
        finally:
            send(PointerFrame(held=False, lift=1.0, x=0.0))
