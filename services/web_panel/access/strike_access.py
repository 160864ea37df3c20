"""Messages of the strike pads' websocket, checked and passed on. viser's thread; nothing here blocks.

A frame is the JSON of [x, y, level]: the place in radii, the level up to 1.
What the rig refuses comes back as text. Whoever gets here has passed web_panel.access.admission.
"""

import asyncio
import math
import time
from collections.abc import Callable

import msgspec
import websockets.asyncio.server as websocket_server
from websockets.exceptions import ConnectionClosed

from web_panel.access.message_rate_limit import MessageRateLimit

PATH = "/strike"
_MAX_PADS = 16
_MAX_FRAME = 200


Play = Callable[[float, float, float, Callable[[str], None]], None]


class Frame(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """Message of the pad."""

    x: float
    y: float
    level: float


def frame_of(text: object) -> Frame | None:
    """The frame, or None for anything that is none."""
    if not isinstance(text, str) or len(text) > _MAX_FRAME:
        return None
    try:
        frame = msgspec.json.decode(text, type=Frame)
    except (msgspec.MsgspecError, ValueError):
        return None
    return frame if math.hypot(frame.x, frame.y) <= 1.0 + 1e-6 and 0.0 < frame.level <= 1.0 else None


class StrikeAccess:
    """Serves the strike pads of every page.

    `play(x, y, level, refused)` asks the rig, and does not block; `refused` gets words, on any thread.
    """

    def __init__(self, play: Play) -> None:
        self._play = play
        self._pads = 0

    async def serve(self, connection: websocket_server.ServerConnection) -> None:
        """One pad, to its end."""
        if self._pads >= _MAX_PADS:
            await connection.close(1013, "too many pads are open")
            return
        loop, pace = asyncio.get_running_loop(), MessageRateLimit(time.monotonic())

        def refused(words: str) -> None:
            asyncio.run_coroutine_threadsafe(connection.send(words), loop)

        self._pads += 1
        try:
            while True:
                frame = frame_of(await connection.recv())
                if not pace.allows(time.monotonic()):
                    await connection.close(1008, "too many messages")
                elif frame is not None:
                    self._play(frame.x, frame.y, frame.level, refused)
        except ConnectionClosed:
            return
        finally:
            self._pads -= 1
