"""One WebSocket client: what it listens to, what it writes, and how much may wait for it.

Belongs to the OSCQuery thread. Commands come as text, {"COMMAND": "LISTEN" or "IGNORE", "DATA": address}, and go so
when the addresses change; OSC packets come and go as binary. Nobody waits for a client: one that does not read loses
its connection.
"""

import asyncio
import contextlib
import json
from collections.abc import Callable, Iterable
from typing import Any, cast

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from haptic_server.gateway.osc.prescan import MAX_BYTES
from haptic_server.gateway.oscquery.osc_bridge import OscBridge
from haptic_server.gateway.oscquery.tree import READ, Node

MAX_WAITING = 512  # packets; a roll of 23 Hz with every address listened to sends 200 a second
MESSAGES_A_SECOND = 1000  # of one client; the next ones are read a second later
MAX_MISTAKES = 100  # of one connection


class Client:
    """`count` is told what was refused or lost; `writer` makes the socket by which the client's packets go to OSC."""

    def __init__(
        self,
        connection: ServerConnection,
        root: Node,
        writer: Callable[[], OscBridge],
        count: Callable[[str], None],
    ) -> None:
        self._connection = connection
        self._root = root
        self._make_writer = writer
        self._writer: OscBridge | None = None
        self._count = count
        self._listened: set[str] = set()  # addresses of the tree, so no more than it has
        self._waiting: asyncio.Queue[bytes | str] = asyncio.Queue(MAX_WAITING)
        self._mistakes = 0
        self._is_cut = False

    def listens(self, address: str) -> bool:
        """True when this client wants what is sent to `address`."""
        return address in self._listened

    def follow(self, root: Node, changed: Iterable[tuple[str, str]]) -> None:
        """Tell of the addresses that another scene has, command and address each; nothing comes from those it lacks."""
        self._root = root
        self._listened &= {node.path for node in root.all() if node.access & READ}
        for command, address in changed:
            self.push(json.dumps({"COMMAND": command, "DATA": address}))

    def push(self, packet: bytes | str) -> None:
        """Send soon; a client for whom too much waits is cut off."""
        if self._is_cut:
            return
        try:
            self._waiting.put_nowait(packet)
        except asyncio.QueueFull:
            self._is_cut = True
            self._count("slow")
            self._connection.transport.abort()

    async def serve(self) -> None:
        """Until the client goes, or must."""
        sending = asyncio.ensure_future(self._send())
        try:
            with contextlib.suppress(ConnectionClosed):
                await self._receive()
        finally:
            sending.cancel()
            await asyncio.wait([sending])
            if self._writer is not None:
                asyncio.get_running_loop().remove_reader(self._writer)
                self._writer.close()

    async def _send(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self._connection.send(await self._waiting.get())

    async def _receive(self) -> None:
        now = asyncio.get_running_loop().time
        begun_s, heard = now(), 0
        async for message in self._connection:
            heard += 1
            if now() - begun_s >= 1.0:
                begun_s, heard = now(), 1
            elif heard > MESSAGES_A_SECOND:
                await asyncio.sleep(begun_s + 1.0 - now())
            understood = self._command(message) if isinstance(message, str) else self._write(message)
            if not understood:
                self._count("mistakes")
                self._mistakes += 1
                if self._mistakes > MAX_MISTAKES:
                    await self._connection.close(1008, "too many messages that cannot be understood")
                    return

    def _command(self, text: str) -> bool:
        try:
            given: Any = json.loads(text)
        except (ValueError, RecursionError):
            return False
        if not isinstance(given, dict):
            return False
        command = cast(dict[str, object], given)
        address = command.get("DATA")
        if not isinstance(address, str) or not address.startswith("/"):
            return False
        node = self._root.find(address)
        if node is None or not node.access & READ:
            return False
        match command.get("COMMAND"):
            case "LISTEN":
                self._listened.add(node.path)
            case "IGNORE":
                self._listened.discard(node.path)
            case _:
                return False
        return True

    def _write(self, packet: bytes) -> bool:
        if not packet or len(packet) > MAX_BYTES:
            return False
        if self._writer is None:
            self._writer = self._make_writer()
            asyncio.get_running_loop().add_reader(self._writer, self._answered)
        if not self._writer.send(packet):
            self._count("unheard")
        return True

    def _answered(self) -> None:
        assert self._writer is not None
        for packet in self._writer.take():
            self.push(packet)
