"""A websocket that ends when too much comes by it: messages, pieces of one message, pings. viser's thread.

`websockets` bounds the bytes of a message but not its pieces, each of which it keeps until the last one is there, and
answers every ping. Counted here, a frame costs nobody anything any more: what counts messages once they are whole never
hears of one that does not end.
"""

import time
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.frames import Frame, Opcode

from web_panel.access.message_rate_limit import MessageRateLimit

_PIECES = 16  # browsers send what fits a frame of ours whole
_READ_BYTES = (
    4096  # of the 256 KiB that TLS hands over at once, which hold 43,000 empty frames: half a second's work
)
_DATA = (Opcode.TEXT, Opcode.BINARY, Opcode.CONT)


class LimitedConnection(ServerConnection):
    """250 frames a second, and as many more as it has saved up, 1000 at most; 16 pieces a message."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        """Take what `websockets` makes a connection with."""
        super().__init__(*arguments, **options)
        self._rate_limit = MessageRateLimit(time.monotonic())
        self._pieces = 0
        self._is_ended = False

    def data_received(self, data: bytes) -> None:
        """Called by asyncio: what came, so little at a time that nothing is read beyond the limits."""
        for begin in range(0, len(data), _READ_BYTES):
            super().data_received(data[begin : begin + _READ_BYTES])

    def process_event(self, event: Any) -> None:
        """Called by `websockets`: the request, then each frame."""
        if self._is_ended:
            return
        if isinstance(event, Frame):
            if event.opcode in _DATA:
                self._pieces = 0 if event.fin else self._pieces + 1
            if self._pieces > _PIECES:
                self._end("a message in too many pieces")
                return
            if not self._rate_limit.allows(time.monotonic()):
                self._end("too many messages")
                return
        super().process_event(event)

    def _end(self, words: str) -> None:
        # Not by `close`, which waits until what was sent before is read: that may be never.
        self._is_ended = True
        self.protocol.fail(1008, words)
        self.send_data()
        self.loop.call_later(self.close_timeout or 0.0, self.transport.abort)
