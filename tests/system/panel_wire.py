"""The panel's websocket without a browser: what a page is made of, and sending anything at all."""

import contextlib
import threading
from typing import Any

import msgspec
import viser
import zstandard
from rig_process import PATIENCE_S
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Origin, Subprotocol

from tls_wire import TlsWire


def dial_port(port: int, origin: str | None = None, path: str = "/", **headers: str) -> Connection:
    """As a browser that shows the page of this origin would; raises what `websockets` raises."""
    return connect(
        f"ws://127.0.0.1:{port}{path}",
        origin=None if origin is None else Origin(origin),
        additional_headers=headers,
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
        open_timeout=PATIENCE_S,
        max_size=None,
        ping_interval=None,  # its thread would tell of a broken connection where a program cuts one off
    )


class Visitor:
    """A program with the token at the websocket: it reads what the page is made of, and may send anything."""

    def __init__(self, socket: Connection | TlsWire) -> None:
        self._socket = socket
        self.parts: dict[str, dict[str, Any]] = {}
        self.updates: list[dict[str, Any]] = []
        self.nodes: dict[str, str] = {}  # of the picture: name -> kind of message

    def read(self) -> None:
        frame = self._socket.recv(timeout=PATIENCE_S)
        assert isinstance(frame, bytes)
        size = int.from_bytes(frame[8:16], "little")
        batch = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size]))
        for message in batch["messages"]:
            if message["type"] == "GuiUpdateMessage":
                self.updates.append(message)
            elif "uuid" in message:
                self.parts[message["uuid"]] = message
            elif "name" in message and "props" in message:
                self.nodes[message["name"]] = message["type"]

    def read_on(self) -> None:
        """Read whatever comes, by a thread, until the connection ends: who does not read is cut off by and by."""

        def reading() -> None:
            with contextlib.suppress(ConnectionClosed):
                while True:
                    self._socket.recv()

        threading.Thread(target=reading, daemon=True).start()

    def find(self, kind: str, label: str) -> str:
        """The id of a part of the page, once it is there."""
        while True:
            for uuid, message in self.parts.items():
                if message["type"] == kind and message["props"].get("label") == label:
                    return uuid
            self.read()

    def send(self, **message: Any) -> None:
        self._socket.send(msgspec.msgpack.encode(message))

    def update(self, uuid: str, **updates: Any) -> None:
        self.send(type="GuiUpdateMessage", uuid=uuid, updates=updates)
