"""Messages of the pad's websocket, checked and passed on. viser's thread; nothing here blocks.

A frame is the JSON of [held, lift, x]: lift 0 pressed .. 1 lifted, x from -1 left to 1 right. Whoever gets here
has passed web_panel.access.admission. A connection that ends has let go.
"""

import secrets
import time
from collections.abc import Callable
from typing import Any

import msgspec
import websockets.asyncio.server as websocket_server
from websockets.exceptions import ConnectionClosed

from protocol.messages import Pointer
from web_panel.access.message_rate_limit import MessageRateLimit

PATH = "/pointer"
_MAX_PADS = 16
_MIN_APART_S = 0.004  # four times what a page sends; what comes oftener is passed over
_MAX_FRAME = 200


class Frame(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """Message of the pad."""

    held: bool
    lift: float
    x: float


def frame_of(text: object) -> Frame | None:
    """The frame, or None for anything that is none."""
    if not isinstance(text, str) or len(text) > _MAX_FRAME:
        return None
    try:
        frame = msgspec.json.decode(text, type=Frame)
    except (msgspec.MsgspecError, ValueError):
        return None
    return frame if 0.0 <= frame.lift <= 1.0 and -1.0 <= frame.x <= 1.0 else None


class Pad:
    """One page's pad; `pointer` gives what is to be sent of a frame, or None."""

    def __init__(self) -> None:
        self._source = secrets.token_hex(8)
        self._seq = 0
        self._held = False
        self._sent_at = float("-inf")

    def pointer(self, frame: Frame, now: float) -> Pointer | None:
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
        self._pads = 0

    async def serve(self, connection: websocket_server.ServerConnection) -> None:
        """One pad, from its first frame to its end."""
        if self._pads >= _MAX_PADS:
            await connection.close(1013, "too many pads are open")
            return
        pad, pace = Pad(), MessageRateLimit(time.monotonic())
        self._pads += 1
        try:
            while True:
                text = await connection.recv()
                if pace.allows(time.monotonic()):
                    self._take(pad, text)
                else:
                    await connection.close(1008, "too many messages")
        except ConnectionClosed:
            return
        finally:
            self._pads -= 1
            self._send(pad, Frame(held=False, lift=1.0, x=0.0))

    def _take(self, pad: Pad, text: Any) -> None:
        frame = frame_of(text)
        if frame is not None:
            self._send(pad, frame)

    def _send(self, pad: Pad, frame: Frame) -> None:
        pointer = pad.pointer(frame, time.monotonic())
        if pointer is not None:
            self._put(pointer)
