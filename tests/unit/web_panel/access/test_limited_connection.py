"""A websocket that ends when too much comes by it. What the whole page does then is tested in system/."""

import asyncio
import contextlib
from collections.abc import Callable

import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from web_panel.access.limited_connection import LimitedConnection

MASK = b"\x80\0\0\0\0"
HEAD = b"\x02" + MASK  # begins a message, without any bytes
PIECE, LAST, PING = b"\x00" + MASK, b"\x80" + MASK, b"\x89" + MASK


async def _beside(play: Callable[[Connection], None], heard: list[object]) -> None:
    async def hear(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                heard.append(await connection.recv())

    def visit(port: int) -> None:
        with connect(f"ws://127.0.0.1:{port}", proxy=None, ping_interval=None) as wire:
            play(wire)

    async with serve(hear, "127.0.0.1", 0, create_connection=LimitedConnection, close_timeout=1.0) as server:
        await asyncio.to_thread(visit, next(iter(server.sockets)).getsockname()[1])


def heard(play: Callable[[Connection], None]) -> list[object]:
    """Messages that the other end heard while a client plays."""
    found: list[object] = []
    asyncio.run(_beside(play, found))
    return found


def ended(wire: Connection) -> str:
    """Words by which the other end closed."""
    with pytest.raises(ConnectionClosed) as closed:
        wire.recv(timeout=10)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    return closed.value.rcvd.reason


def test_a_message_in_few_pieces_is_heard_again_and_again() -> None:
    def play(wire: Connection) -> None:
        for _ in range(20):
            wire.socket.sendall(HEAD + 15 * PIECE + LAST)
        wire.send("and a whole one")
        assert wire.ping().wait(10)

    assert heard(play) == [b""] * 20 + ["and a whole one"]


def test_a_message_that_never_ends_ends_its_connection() -> None:
    def play(wire: Connection) -> None:
        wire.socket.sendall(HEAD + 16 * PIECE)
        assert ended(wire) == "a message in too many pieces"

    assert heard(play) == []


@pytest.mark.parametrize("frame", [PING, b"\x8a" + MASK, b"\x82" + MASK])
def test_frames_of_every_kind_are_counted(frame: bytes) -> None:
    def play(wire: Connection) -> None:
        wire.socket.sendall(frame * 900)
        assert wire.ping().wait(10)
        wire.socket.sendall(frame * 2000)
        assert ended(wire) == "too many messages"

    assert len(heard(play)) <= 2000


def test_little_is_read_beyond_the_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[object] = []
    take = LimitedConnection.process_event

    def noted(self: LimitedConnection, event: object) -> None:
        read.append(event)
        take(self, event)

    monkeypatch.setattr(LimitedConnection, "process_event", noted)

    def play(wire: Connection) -> None:
        wire.socket.sendall((b"\x82" + MASK) * 20_000 + b"\x81" + MASK)
        assert ended(wire) == "too many messages"

    assert "" not in heard(play)
    assert len(read) < 3000
