"""A websocket that ends when too much comes by it. What the whole page does then is tested in system/."""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Callable
from http import HTTPStatus
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from rig.identity.page_certificate import page_certificate
from web_panel.access.lan_listener import tls_of
from web_panel.access.limited_connection import LimitedConnection

MASK = b"\x80\0\0\0\0"
HEAD = b"\x02" + MASK  # begins a message, without any bytes
PIECE, LAST, PING = b"\x00" + MASK, b"\x80" + MASK, b"\x89" + MASK
WHOLE, CLOSE = b"\x82" + MASK, b"\x88" + MASK
REQUEST = (
    b"GET / HTTP/1.1\r\nHost: here\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
)
NO_REQUEST = b"GET /\r\n\r\n"
NEVER_S = 3600.0


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
        wire.recv(timeout=60)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    return closed.value.rcvd.reason


def test_a_message_in_sixteen_pieces_is_heard_again_and_again() -> None:
    def play(wire: Connection) -> None:
        for _ in range(20):
            wire.socket.sendall(HEAD + 14 * PIECE + LAST)
        wire.send("and a whole one")
        assert wire.ping().wait(60)

    assert heard(play) == [b""] * 20 + ["and a whole one"]


@pytest.mark.parametrize("last", [LAST, PIECE])
def test_a_message_in_one_piece_more_ends_its_connection(last: bytes) -> None:
    def play(wire: Connection) -> None:
        wire.socket.sendall(HEAD + 15 * PIECE + last)
        assert ended(wire) == "a message in too many pieces"

    assert heard(play) == []


@pytest.mark.parametrize("frame", [PING, b"\x8a" + MASK, WHOLE])
def test_frames_of_every_kind_are_counted(frame: bytes) -> None:
    def play(wire: Connection) -> None:
        wire.socket.sendall(frame * 900)
        assert wire.ping().wait(60)
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
        wire.socket.sendall(WHOLE * 20_000 + b"\x81" + MASK)
        assert ended(wire) == "too many messages"

    assert "" not in heard(play)
    assert len(read) < 3000


async def _beside_bytes(
    visit: Callable[[int], None], refused: bool = False, tls: ssl.SSLContext | None = None
) -> None:
    async def hear(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await connection.recv()

    def answer(connection: ServerConnection, _: Request) -> Response | None:
        return connection.respond(HTTPStatus.UNAUTHORIZED, "no") if refused else None

    more: dict[str, Any] = {} if tls is None else {"ssl": tls, "ssl_shutdown_timeout": NEVER_S}
    async with serve(
        hear, "127.0.0.1", 0, create_connection=LimitedConnection, close_timeout=1.0, process_request=answer, **more
    ) as server:  # fmt: skip
        await asyncio.to_thread(visit, next(iter(server.sockets)).getsockname()[1])


def words(caplog: pytest.LogCaptureFixture) -> set[str]:
    """Words of the log without those that the panel leaves out."""
    return {record.getMessage() for record in caplog.records} - {"opening handshake failed"}


@pytest.mark.parametrize("refused", [False, True])
@pytest.mark.parametrize("frame", [PING, WHOLE, CLOSE, LAST, 2000 * PING, REQUEST])
def test_who_says_more_before_he_is_answered_is_cut_off(
    frame: bytes, refused: bool, caplog: pytest.LogCaptureFixture
) -> None:
    got: list[bytes] = []

    def visit(port: int) -> None:
        with socket.create_connection(("127.0.0.1", port), 60) as wire, contextlib.suppress(OSError):
            wire.sendall(REQUEST + frame)
            while part := wire.recv(4096):
                got.append(part)

    asyncio.run(_beside_bytes(visit, refused))
    assert b"HTTP" not in b"".join(got)
    assert words(caplog) == set()


def certified(folder: Path) -> tuple[ssl.SSLContext, ssl.SSLContext]:
    """Contexts of the server and of a client who knows its certificate."""
    certificate, key = page_certificate(folder, "127.0.0.1")
    trusted = ssl.create_default_context(cafile=str(certificate))
    trusted.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    return tls_of(certificate, key), trusted


@pytest.mark.parametrize(
    ("first", "then"),
    [(REQUEST, CLOSE + 2000 * WHOLE), (REQUEST, 9000 * WHOLE), (b"", NO_REQUEST + bytes(9000))],
    ids=["closed", "flood", "no request"],
)
def test_bytes_behind_the_end_of_ones_own_connection_are_no_news(
    first: bytes, then: bytes, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    own, trusted = certified(tmp_path)
    there = socket.create_server(("127.0.0.1", 0))

    async def hear(connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await connection.recv()

    async def play() -> None:
        # Both ends in one loop, so that the panel's finds all bytes and the end of TLS at once.
        async with serve(hear, sock=there, ssl=own, create_connection=LimitedConnection, close_timeout=1.0):
            reader, writer = await asyncio.open_connection(*there.getsockname(), ssl=trusted)
            if first:
                writer.write(first)
                assert b" 101 " in await reader.readuntil(b"\r\n\r\n")
            writer.write(then)
            writer.close()
            with contextlib.suppress(OSError):
                await asyncio.wait_for(writer.wait_closed(), 60)

    asyncio.run(play())
    assert words(caplog) == set()


def test_who_sends_no_request_holds_no_place(tmp_path: Path) -> None:
    own, trusted = certified(tmp_path)

    def visit(port: int) -> None:
        plain = socket.create_connection(("127.0.0.1", port), 60)
        with trusted.wrap_socket(plain, server_hostname="127.0.0.1") as wire:
            wire.sendall(NO_REQUEST)
            with socket.socket(fileno=wire.detach()) as below:
                below.settimeout(60)
                with contextlib.suppress(ConnectionResetError):
                    while below.recv(4096):  # what TLS says; its end, which nobody answers here
                        continue

    asyncio.run(_beside_bytes(visit, tls=own))
