"""The OSCQuery server: HTTP and WebSocket at one port, on a thread of its own with its own event loop.

It holds nobody up. What the rig sends arrives in a socket buffer that drops when it is full (osc_bridge.py); a question
about parameters asks the parameters for its readback as OSC and Zenoh do. What clients can use up has limits.
"""

import asyncio
import logging
import socket
import threading
from collections import Counter
from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from haptic_server.gateway.osc.inbound import Network
from haptic_server.gateway.osc.osc_server import LOOPBACK
from haptic_server.gateway.osc.prescan import MAX_BYTES
from haptic_server.gateway.osc.reply_rate_limit import ReplyRateLimit
from haptic_server.gateway.osc.targets import Endpoint
from haptic_server.gateway.oscquery.admission import Admission
from haptic_server.gateway.oscquery.client import Client
from haptic_server.gateway.oscquery.osc_bridge import OscBridge
from haptic_server.gateway.oscquery.pages import Page, page
from haptic_server.gateway.oscquery.tree import EXTENSIONS, Node, changes, tree_of
from haptic_server.gateway.oscquery.values import Values
from haptic_server.gateway.settings import Parameters
from protocol.endpoint import is_loopback

MAX_CONNECTIONS = 64  # in whatever state, so that half-open ones use up neither memory nor descriptors
MAX_CLIENTS = 16  # of these, over WebSocket
QUESTIONS_A_SECOND = (
    200,
    400,
)  # of one source, of all: a tree of 40 nodes costs the interpreter about 0.3 ms
_KEPT_BYTES = 1 << 16  # by the system, for each client
_OPEN_WITHIN_S = 5.0
_CLOSE_WITHIN_S = 1.0
_JOIN_S = 3.0

_log = logging.getLogger("gateway")
# websockets tells every half-open connection and every garbled request, with a traceback: they are counted instead.
_quiet = logging.getLogger("gateway.oscquery.websockets")
_quiet.setLevel(logging.CRITICAL + 1)


def numeric(host: str) -> str:
    """The IPv4 address of a name; OSError when there is none."""
    return str(socket.getaddrinfo(host, None, socket.AF_INET, socket.SOCK_STREAM)[0][4][0])


class OscQuery:
    """Serves at `bind` until `close`.

    The constructor opens the port and starts the thread; it raises OSError when the port is taken. `inlet` is a target
    of the front at `front` and belongs to this server from now on.
    """

    def __init__(
        self,
        bind: tuple[str, int],
        rig: str,
        prefix: str,
        parameters: Parameters,
        front: Endpoint,
        bridge: OscBridge,
        allow: Sequence[Network] = LOOPBACK,
        insiders: set[Endpoint] | None = None,
    ) -> None:
        self._name = f"drumstick {rig}"
        self._prefix = prefix
        self._root, self._values = tree_of(prefix, parameters.table), Values(parameters)
        self._front = front
        self._insiders: set[Endpoint] = set() if insiders is None else insiders
        self._bridge = bridge
        self._rate_limit = ReplyRateLimit(*QUESTIONS_A_SECOND)
        self._log_limited = ReplyRateLimit(1, 1)
        self._clients: set[Client] = set()
        self._open = 0
        self._counts: Counter[str] = Counter()
        self._tcp = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            self._tcp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            # The system would keep megabytes for a client that does not read: minutes of what is no longer so.
            self._tcp.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _KEPT_BYTES)
            self._tcp.bind((numeric(bind[0]), bind[1]))
            self._tcp.listen(MAX_CONNECTIONS)
        except BaseException:
            self._tcp.close()
            raise
        host, port = self._tcp.getsockname()
        self.endpoint: Endpoint = (str(host), int(port))
        self._admission = Admission(self.endpoint[0], allow)
        bridge.join(front[1])
        self._loop = asyncio.new_event_loop()
        self._stop = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="oscquery", daemon=True)
        self._thread.start()

    def play_scene(self, parameters: Parameters) -> None:
        """Describe the addresses of another scene from now on, and tell clients which have changed. Any thread."""
        if self._thread.is_alive():
            root, values = tree_of(self._prefix, parameters.table), Values(parameters)
            self._loop.call_soon_threadsafe(self._follow, root, values)

    def _follow(self, root: Node, values: Values) -> None:
        changed = list(changes(self._root, root))
        self._root, self._values = root, values
        for client in self._clients:
            client.follow(root, changed)

    @property
    def is_on_loopback(self) -> bool:
        """True when only this machine can reach it."""
        return is_loopback(self.endpoint[0])

    @property
    def counters(self) -> dict[str, int]:
        """Counts of questions by status, slow clients, connections turned away ...; a copy. Any thread."""
        return {**self._counts, "clients": len(self._clients), "dropped": self._bridge.dropped}

    def close(self) -> None:
        """End the thread and close the port. Any thread; waits three seconds at most. Idempotent."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._stop.set)
            self._thread.join(_JOIN_S)

    def _run(self) -> None:
        try:
            self._loop.run_until_complete(self._serve())
        finally:
            self._loop.close()
            self._bridge.close()
            self._tcp.close()

    async def _serve(self) -> None:
        self._loop.add_reader(self._bridge, self._sent)
        async with serve(
            self._client,
            sock=self._tcp,
            process_request=self._answer,
            create_connection=self._connections(),
            compression=None,
            open_timeout=_OPEN_WITHIN_S,
            close_timeout=_CLOSE_WITHIN_S,
            max_size=MAX_BYTES,
            server_header=None,
            logger=_quiet,
        ):
            await self._stop.wait()
        self._loop.remove_reader(self._bridge)

    def _connections(self) -> type[ServerConnection]:
        # A connection is counted, and turned away, before the first byte of it is read.
        query = self

        class Counted(ServerConnection):
            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                if not query._comes(transport):
                    self.transport.abort()

            def connection_lost(self, exc: Exception | None) -> None:
                query._goes()
                super().connection_lost(exc)

        return Counted

    def _comes(self, transport: asyncio.BaseTransport) -> bool:
        self._open += 1
        peer: Any = transport.get_extra_info("peername")
        if peer is None or not self._admission.admits(str(peer[0])):
            self._counts["source"] += 1
        elif self._open > MAX_CONNECTIONS:
            self._counts["crowded"] += 1
        else:
            return True
        return False

    def _goes(self) -> None:
        self._open -= 1

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        # None lets the WebSocket handshake go on.
        try:
            answer = self._page(connection, request)
        except Exception:  # websockets answers 500, and nobody else would say why
            if self._log_limited.spend("any", self._loop.time()):
                _log.exception("oscquery: a fault in %r", request.path)
            raise
        if answer is None:
            return None
        self._counts[str(answer.status.value)] += 1
        return _response(answer)

    def _page(self, connection: ServerConnection, request: Request) -> Page | None:
        verdict = self._admission.judge(request.headers)
        if verdict.status is not HTTPStatus.OK:
            return Page(verdict.status, verdict.words)
        peer: Any = connection.remote_address
        if not self._rate_limit.spend(peer[0], self._loop.time()):
            return Page(HTTPStatus.SERVICE_UNAVAILABLE, "Too many questions at once: ask again in a second.")
        if "Upgrade" in request.headers:
            if len(self._clients) < MAX_CLIENTS:
                return None
            return Page(
                HTTPStatus.SERVICE_UNAVAILABLE, f"{MAX_CLIENTS} clients are connected: no more at once."
            )
        host = str(connection.local_address[0])
        return page(self._root, self._values.snapshot(), request.path, self._host_info(host))

    def _host_info(self, reached_at: str) -> dict[str, object]:
        osc_host, osc_port = self._front
        return {
            "NAME": self._name,
            "OSC_IP": reached_at if osc_host == "0.0.0.0" else osc_host,
            "OSC_PORT": osc_port,
            "OSC_TRANSPORT": "UDP",
            "WS_IP": reached_at,
            "WS_PORT": self.endpoint[1],
            "EXTENSIONS": EXTENSIONS,
        }

    async def _client(self, connection: ServerConnection) -> None:
        client = Client(connection, self._root, self._writer, self._count)
        self._clients.add(client)
        try:
            await client.serve()
        finally:
            self._clients.discard(client)

    def _writer(self) -> OscBridge:
        made = OscBridge(self._front[0], self._insiders)
        made.join(self._front[1])
        return made

    def _count(self, what: str) -> None:
        self._counts[what] += 1

    def _sent(self) -> None:
        for packet in self._bridge.take():
            address = self._values.note(packet)
            for client in self._clients:
                if client.listens(address):
                    client.push(packet)


def _response(answer: Page) -> Response:
    ok = answer.status is HTTPStatus.OK
    kind = "application/json" if ok else "text/plain; charset=utf-8"
    body = answer.body.encode() if ok or not answer.body else f"{answer.body}\n".encode()
    headers = Headers({"Connection": "close", "Cache-Control": "no-store"})
    headers["X-Content-Type-Options"] = "nosniff"
    if answer.status is not HTTPStatus.NO_CONTENT:  # which has no body, and says nothing about one
        headers["Content-Type"] = kind
        headers["Content-Length"] = str(len(body))
    if answer.status is HTTPStatus.SERVICE_UNAVAILABLE:
        headers["Retry-After"] = "1"
    return Response(answer.status.value, answer.status.phrase, headers, body)
