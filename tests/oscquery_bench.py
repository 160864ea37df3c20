"""Bench of the OSCQuery tests: questions over HTTP, listening over WebSocket, a server without a rig."""

import http.client
import json
import socket
import struct
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from websockets.sync.client import ClientConnection, connect

from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.oscquery.osc_bridge import OscBridge
from haptic_server.gateway.oscquery.server import OscQuery
from osc_bench import BOUND_S, Client, FakeParameters

Reply = tuple[int, dict[str, str], bytes]


def get(port: int, path: str = "/", headers: dict[str, str] | None = None) -> Reply:
    """Status, headers in small letters, body; OSError when the connection is refused or cut."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=BOUND_S)
    try:
        connection.request("GET", path, headers=headers or {})
        reply = connection.getresponse()
        return reply.status, {k.lower(): v for k, v in reply.getheaders()}, reply.read()
    except http.client.HTTPException as error:
        raise ConnectionError(repr(error)) from error
    finally:
        connection.close()


def told(port: int, path: str = "/") -> Any:
    """The JSON of a question that must be answered."""
    status, headers, body = get(port, path)
    assert status == 200, (status, body)
    assert headers["content-type"] == "application/json"
    return json.loads(body)


def until(what: str, is_so: Callable[[], bool], patience_s: float = BOUND_S) -> None:
    """Wait for something that another thread does."""
    end = time.monotonic() + patience_s
    while not is_so():
        assert time.monotonic() < end, f"waited {patience_s:.0f} s in vain for {what}"
        time.sleep(0.005)


@contextmanager
def listening(port: int, *paths: str, **options: Any) -> Iterator[ClientConnection]:
    """A WebSocket client that listens to these addresses."""
    with connect(f"ws://127.0.0.1:{port}/", compression=None, open_timeout=BOUND_S, **options) as client:
        for path in paths:
            client.send(json.dumps({"COMMAND": "LISTEN", "DATA": path}))
        # Answered after them: a datagram that is sent next could overtake them otherwise.
        assert client.ping().wait(BOUND_S)
        yield client


@contextmanager
def served(parameters: FakeParameters, *targets: Client) -> Iterator[tuple[OscQuery, OscServer]]:
    """OSC front and OSCQuery server, joined as the gateway joins them."""
    inlet = OscBridge("127.0.0.1")
    endpoints = [*(t.endpoint for t in targets), inlet.endpoint]
    front = OscServer(("127.0.0.1", 0), endpoints, "/drumstick", parameters, parameters.load_preset)
    query = OscQuery(("127.0.0.1", 0), "main", "/drumstick", parameters, front.endpoint, inlet)
    try:
        yield query, front
    finally:
        query.close()
        front.close()


def connected_deaf(port: int) -> socket.socket:
    """A WebSocket client that never reads."""
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deaf.connect(("127.0.0.1", port))
    deaf.sendall(
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
        b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )
    return deaf


def frame(payload: bytes) -> bytes:
    """A masked text frame, by a mask of zeros."""
    assert len(payload) < 126
    return struct.pack("!BB4x", 0x81, 0x80 | len(payload)) + payload
