"""Messages of the strike pads' websocket, checked and passed on. viser's thread; nothing here blocks.

A frame is the JSON of [x, y, level]: the place in radii, the level up to 1; level 0 chokes the drum. What the rig
refuses comes back as text.
"""

import asyncio
import math
from collections.abc import Callable
from typing import Annotated

import msgspec
import websockets.asyncio.server as websocket_server

from web_panel.access.pad_socket import PadSocket

PATH = "/strike"

Play = Callable[[float, float, float, Callable[[str], None]], None]
Choke = Callable[[Callable[[str], None]], None]


class StrikeFrame(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    """Message of the pad."""

    x: float
    y: float
    level: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]

    def __post_init__(self) -> None:
        if not math.hypot(self.x, self.y) <= 1.0 + 1e-6:
            raise ValueError("beyond the head")


class StrikeAccess:
    """Serves the strike pads of every page.

    `play(x, y, level, refused)` and `choke(refused)` ask the rig, and do not block; `refused` gets words, on any
    thread.
    """

    def __init__(self, play: Play, choke: Choke) -> None:
        self._play, self._choke = play, choke
        self._socket = PadSocket()

    async def serve(self, connection: websocket_server.ServerConnection) -> None:
        """One pad, to its end."""
        loop = asyncio.get_running_loop()

        def refused(words: str) -> None:
            asyncio.run_coroutine_threadsafe(connection.send(words), loop)

        def play(frame: StrikeFrame) -> None:
            if frame.level == 0.0:
                self._choke(refused)
            else:
                self._play(frame.x, frame.y, frame.level, refused)

        await self._socket.serve(connection, StrikeFrame, play)
