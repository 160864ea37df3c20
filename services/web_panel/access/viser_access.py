"""viser, guarded. The only file that leans on viser's inside; it refuses to start when that is not as expected.

viser has no authentication, no Origin check, and lets a client change any attribute of any control. It serves pages
and websockets by one call of `websockets.asyncio.server.serve`; while a server is being made, that call goes through
`_GuardedServe`, which puts `Admission` before every request and `ClientMessages` before every frame. What else viser
does (another way to serve, another method of the connection, another shape of message) meets nothing that answers,
so it fails closed; and before the address is printed the guard is tried from outside.
"""

import asyncio
import functools
import http.client
import inspect
import logging
import os
import queue
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable, Mapping
from contextlib import asynccontextmanager
from contextvars import ContextVar
from http import HTTPStatus
from typing import Any, NamedTuple, NoReturn, cast

import rich
import viser
import websockets.asyncio.server as websocket_server
from viser.infra._async_message_buffer import AsyncMessageBuffer
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from web_panel.access.admission import Admission
from web_panel.access.client_message import CAMERA_AT_FIRST, MAX_FRAME_BYTES, ClientMessages
from web_panel.access.lan_admission import LanAdmission
from web_panel.access.lan_listener import HANDSHAKE_S, Lan
from web_panel.access.limited_connection import LimitedConnection

ServeSocket = Callable[[websocket_server.ServerConnection], Awaitable[None]]
HOST = "127.0.0.1"
_START_S = 30.0
_CLOSE_S = 1.0  # a browser that leaves a websocket or a refusal open holds up the panel's end no longer
_PAGE_S = 9.0  # for 0.7 MB to a slow phone; `websockets` ends after 10 s what is no websocket yet
_LOOK_AT_CLOCK_S = 60.0
_log = logging.getLogger("panel")
# viser gives each message of a browser a task that begins with the context of its connection's reader. Whoever has come
# before anybody listened is told of from another context: he may be anywhere.
_FROM_LAN: ContextVar[bool] = ContextVar("from_lan", default=True)


def is_from_lan() -> bool:
    """True while something of a browser on another machine is handled; False for those of this machine."""
    return _FROM_LAN.get()


class ViserIncompatible(Exception):
    """viser is not as this guard knows it; nothing is served."""


class OwnPage(NamedTuple):
    """A page of our own, which viser does not see: its HTML, and what its Content-Security-Policy lets it load, with
    {websocket} where the panel's own stands."""

    html: bytes
    policy: str


class _Wire:
    """The four things that viser may do with a connection, and no other."""

    def __init__(self, connection: websocket_server.ServerConnection, messages: ClientMessages) -> None:
        self._connection = connection
        self._messages = messages
        self._greeted = False

    @property
    def subprotocol(self) -> str | None:
        return self._connection.subprotocol

    async def recv(self) -> bytes:
        if not self._greeted:
            self._greeted = True
            return CAMERA_AT_FIRST
        while True:
            frame = await self._connection.recv()
            if isinstance(frame, bytes) and self._messages.admits(frame):
                return frame

    async def send(self, frame: bytes) -> None:
        await self._connection.send(frame)

    async def close(self, code: int = 1000, reason: str = "") -> None:
        await self._connection.close(code, reason)


class _GuardedServe:
    """Stands in for `serve` while viser starts."""

    def __init__(
        self,
        admission: Admission,
        messages: ClientMessages,
        sockets: Mapping[str, ServeSocket],
        own_pages: Mapping[str, OwnPage],
        lan: Lan | None,
    ) -> None:
        self.admission = admission
        self.messages = messages
        self.sockets = sockets
        self.own_pages = own_pages
        self.lan = lan
        self.calls = 0
        self.made: queue.SimpleQueue[BaseException | viser.ViserServer] = queue.SimpleQueue()
        self.original: Callable[..., Any] = websocket_server.serve

    def serve(self, *arguments: Any, **options: Any) -> Any:
        """Called by viser's thread."""
        self.calls += 1
        pages: Any = options.pop("process_request", None)
        if len(arguments) != 3 or arguments[1:] != (HOST, self.admission.port):
            self._refuse(f"it serves at {arguments[1:]}, not at {HOST}:{self.admission.port}")
        if not inspect.iscoroutinefunction(arguments[0]) or not callable(pages):
            self._refuse("it serves by other parts than a handler and process_request")
        pages = cast(Callable[[object, Request], object], pages)
        options["max_size"] = MAX_FRAME_BYTES
        options["close_timeout"] = _CLOSE_S
        options["create_connection"] = LimitedConnection
        return self._serve(arguments[0], pages, options)

    @asynccontextmanager
    async def _serve(
        self,
        handler: Callable[..., Awaitable[None]],
        pages: Callable[[object, Request], object],
        options: dict[str, Any],
    ) -> AsyncGenerator[Any]:
        own = self._pages(pages, self.admission)
        async with self.original(
            self._frames(handler), HOST, self.admission.port, process_request=own, **options
        ) as server:
            if self.lan is None:
                yield server
                return
            others = self._pages(pages, self.lan.admission)
            async with self.original(
                self._frames(handler, self.lan.admission), sock=self.lan.listener, ssl=self.lan.tls,
                ssl_handshake_timeout=HANDSHAKE_S, ssl_shutdown_timeout=_PAGE_S,
                process_request=others, **options,
            ):  # fmt: skip
                yield server

    def _refuse(self, words: str) -> NoReturn:
        self.made.put(ViserIncompatible(f"viser {viser.__version__} is not as the guard knows it: {words}"))
        raise SystemExit  # ends viser's thread without a word: the waiting thread has them

    def _frames(
        self, handler: Callable[..., Awaitable[None]], lan: LanAdmission | None = None
    ) -> Callable[..., Awaitable[None]]:
        async def guarded(connection: websocket_server.ServerConnection) -> None:
            _FROM_LAN.set(lan is not None)
            request = connection.request
            serve = self.sockets.get(request.path.partition("?")[0]) if request is not None else None
            end = None if lan is None else asyncio.create_task(_close_when_the_cookie_ends(connection, lan))
            try:
                if serve is not None:
                    await serve(connection)
                else:
                    await handler(_Wire(connection, self.messages))
            finally:
                if end is not None:
                    end.cancel()

        return guarded

    def _pages(
        self, pages: Callable[[object, Request], object], admission: Admission
    ) -> Callable[..., Response | None]:
        def guarded(connection: websocket_server.ServerConnection, request: Request) -> Response | None:
            verdict = admission.judge(request.headers, request.path)
            if verdict.status is not HTTPStatus.OK:
                return _refusal(verdict.status, verdict.words)
            if self.lan is not None and admission is self.lan.admission:
                self.lan.listener.keep_places_for(connection.remote_address[0])
                if verdict.by_address:
                    _log.info("panel: %s came in by the login link", connection.remote_address[0])
            websocket = f"{admission.scheme.replace('http', 'ws')}://{verdict.host}"
            own = self.own_pages.get(request.path.partition("?")[0])
            response = (
                pages(connection, request) if own is None else _answer("text/html", HTTPStatus.OK, own.html)
            )
            if response is None:
                return None
            if not isinstance(response, Response):
                return _refusal(
                    HTTPStatus.INTERNAL_SERVER_ERROR, "The panel's guard does not know this answer."
                )
            _add_headers(response.headers, _POLICY if own is None else own.policy, websocket)
            if verdict.by_address:
                response.headers["Set-Cookie"] = admission.cookie
            connection.close_timeout = _PAGE_S
            return response

        return guarded


async def _close_when_the_cookie_ends(
    connection: websocket_server.ServerConnection, lan: LanAdmission
) -> None:
    end = lan.end_of(connection.request.headers if connection.request is not None else Headers())
    while (left_s := end - lan.clock()) > 0.0:
        # The day's clock may be set, and goes on while the machine sleeps, which the loop's does not.
        await asyncio.sleep(min(left_s, _LOOK_AT_CLOCK_S))
    await connection.close(1008, "log in again")


class _Bell(asyncio.Event):
    """viser's "a message is there", which it rings from any thread and then asks its loop to ring.

    asyncio's own is for the loop alone: rung by another thread while a browser's task begins or ends to wait, it raises
    "deque mutated during iteration" into whoever wrote to the page. Outside a loop this one leaves it to the loop.
    """

    def set(self) -> None:
        try:
            asyncio.get_running_loop()
        except RuntimeError:
            return
        super().set()


def ring_in_the_loop() -> None:
    """Give every buffer of messages that viser makes from now on such a bell."""
    buffers: Any = AsyncMessageBuffer
    make = buffers.__init__
    if hasattr(make, "__wrapped__"):
        return

    @functools.wraps(make)
    def made(buffer: Any, *arguments: Any, **options: Any) -> None:
        make(buffer, *arguments, **options)
        buffer.message_event = _Bell()

    buffers.__init__ = made


def _answer(kind: str, status: HTTPStatus, body: bytes) -> Response:
    headers = Headers({"Content-Type": f"{kind}; charset=utf-8", "Content-Length": str(len(body))})
    return Response(status.value, status.phrase, headers, body)


def _refusal(status: HTTPStatus, words: str) -> Response:
    refusal = _answer("text/plain", status, (words + "\n").encode())
    refusal.headers["Cache-Control"] = "no-store"
    refusal.headers["Connection"] = "close"
    return refusal


# viser's page is one file with its scripts, styles, workers and WebAssembly inside; it needs no other machine.
_POLICY = (
    "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; connect-src 'self' {websocket} data: blob:"
)


def _add_headers(headers: Headers, policy: str, websocket: str) -> None:
    headers["Content-Security-Policy"] = (
        policy.format(websocket=websocket) + "; frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
    )
    headers["Referrer-Policy"] = "no-referrer"
    headers["X-Content-Type-Options"] = "nosniff"
    headers["Connection"] = (
        "close"  # one file, one request: a connection kept alive would delay the panel's end
    )
    headers["Cache-Control"] = "no-store"


def _quiet(record: logging.LogRecord) -> bool:
    # A port scanner's half request is no news; a fault in a handler is, and stays.
    return record.getMessage() != "opening handshake failed"


def start(
    admission: Admission,
    messages: ClientMessages,
    sockets: Mapping[str, ServeSocket] | None = None,
    lan: Lan | None = None,
    own_pages: Mapping[str, OwnPage] | None = None,
) -> viser.ViserServer:
    """A guarded server on 127.0.0.1 that is already heard; stop it with `.stop()`. Raises ViserIncompatible. Main
    thread.

    `sockets` serve the websockets at their paths, those of pads and of the stage, and `own_pages` are the pages at
    theirs, behind the same guard; they never reach viser. `lan`: the same for other machines, behind its own admission.
    """
    if viser.__version__.split(".")[:2] != ["1", "1"]:
        raise ViserIncompatible(f"viser {viser.__version__} is installed; this guard knows 1.1 only")
    rich.reconfigure(quiet=True)  # viser's banners
    logging.getLogger("websockets.server").addFilter(_quiet)
    os.environ.pop("_VISER_PORT_OVERRIDE", None)
    ring_in_the_loop()
    guarded = _GuardedServe(admission, messages, sockets or {}, own_pages or {}, lan)

    def make() -> None:
        try:
            guarded.made.put(viser.ViserServer(host=HOST, port=admission.port, verbose=False))
        except Exception as error:  # noqa: BLE001  told to the waiting thread, which raises it
            guarded.made.put(error)

    websocket_server.serve = guarded.serve
    try:
        # In a thread: when its server thread dies, viser's constructor waits for ever.
        threading.Thread(target=make, name="viser start", daemon=True).start()
        made = guarded.made.get(timeout=_START_S)
    except queue.Empty:
        raise ViserIncompatible(f"viser did not start within {_START_S:g} s") from None
    finally:
        websocket_server.serve = guarded.original
    if not isinstance(made, viser.ViserServer):
        raise (
            made
            if isinstance(made, ViserIncompatible)
            else ViserIncompatible(f"viser did not start: {made!r}")
        )
    try:
        _check_from_outside(made, guarded)
    except ViserIncompatible:
        made.stop()
        raise
    made.request_share_url = _no_share_url
    return made


def _no_share_url(verbose: bool = True) -> str | None:
    """Refuse viser's tunnel to a public server."""
    return None


def _check_from_outside(server: viser.ViserServer, guarded: _GuardedServe) -> None:
    port = guarded.admission.port
    websockets: Any = server._websock_server  # pyright: ignore[reportPrivateUsage]
    if not isinstance(getattr(websockets.get_message_buffer(), "message_event", None), _Bell):
        raise ViserIncompatible("viser's messages are not told by the bell that the guard gave them")
    if guarded.calls != 1 or server.get_port() != port:
        raise ViserIncompatible(
            f"viser served {guarded.calls} times through the guard, at port {server.get_port()}"
        )
    tries: tuple[tuple[str, dict[str, str], HTTPStatus], ...] = (
        ("/", {}, HTTPStatus.UNAUTHORIZED),
        (f"/?token={guarded.admission.token}", {}, HTTPStatus.OK),
        ("/", {"Host": "elsewhere.example"}, HTTPStatus.MISDIRECTED_REQUEST),
    )
    for path, headers, expected in tries:
        connection = http.client.HTTPConnection(HOST, port, timeout=10.0)
        try:
            connection.request("GET", path, headers=headers)
            status = connection.getresponse().status
        except OSError as error:
            raise ViserIncompatible(f"the guard's own visit failed: {error}") from None
        finally:
            connection.close()
        if status != expected:
            raise ViserIncompatible(f"viser answered {status} where the guard says {expected.value}")


def control_id(
    handle: viser.GuiInputHandle[Any] | viser.GuiButtonHandle | viser.GuiButtonGroupHandle,
) -> str:
    """The id by which browsers name this control."""
    return handle._impl.uuid  # pyright: ignore[reportPrivateUsage]


def key_id(handle: viser.CommandHandle) -> str:
    """The id by which browsers name this key."""
    return handle._impl.uuid  # pyright: ignore[reportPrivateUsage]
