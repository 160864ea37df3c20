"""A websocket that ends when too much comes by it: messages, pieces of one message, pings. viser's thread.

`websockets` bounds the bytes of a message but not its pieces, each of which it keeps until the last one is there, and
answers every ping. Counted here, a frame costs nobody anything any more: what counts messages once they are whole never
hears of one that does not end. Whoever sends no request, or more before he has its answer, is cut off without a word.
"""

import time
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.frames import Frame, Opcode

from web_panel.access.message_rate_limit import MessageRateLimit

_PIECES = 16  # the last one counts too; browsers send what fits a frame of ours whole
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
            if self.transport.is_closing():
                return  # the protocol raises at bytes behind its end, into the log
            super().data_received(data[begin : begin + _READ_BYTES])
            if self.response is None and self.protocol.eof_sent:
                self._cut_off()

    def process_event(self, event: Any) -> None:
        """Called by `websockets`: the request, then each frame."""
        if self._is_ended:
            return
        if isinstance(event, Frame):
            if self.response is None:
                self._cut_off()
                return
            if event.opcode in _DATA:
                self._pieces += 1
                if self._pieces > _PIECES:
                    self._end("a message in too many pieces")
                    return
                if event.fin:
                    self._pieces = 0
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

    def _cut_off(self) -> None:
        # The protocol first: `websockets` would go on to answer the request, and log an internal error.
        self._is_ended = True
        self.protocol.receive_eof()
        self.transport.abort()
