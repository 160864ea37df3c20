"""The guard starts viser behind its door, or not at all. What comes through the door is tested in system/."""

import asyncio
import http.client
import logging
import socket
import ssl
import subprocess
import sys
import threading
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import viser
import websockets.asyncio.server as websocket_server
from viser._messages import ResetGuiMessage
from viser.infra._async_message_buffer import AsyncMessageBuffer
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from realtime.service_options import command
from rig.identity.page_certificate import page_certificate
from tls_wire import TlsWire
from web_panel.access import viser_access
from web_panel.access.admission import Admission
from web_panel.access.client_message import ClientMessages
from web_panel.access.lan_admission import LIFE_H, LanAdmission
from web_panel.access.lan_listener import Lan, LimitedListener, tls_of
from web_panel.access.one_time_login import OneTimeLogin
from web_panel.options import PanelOptions

TOKEN = "a" * 43
# viser's thread is ended by SystemExit, which Python passes over in silence and pytest reports.
ends_a_thread = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")


def test_it_starts_on_loopback_behind_the_door_and_leaves_no_trace(free_port: Callable[[], int]) -> None:
    serve = websocket_server.serve
    port = free_port()
    server = viser_access.start(Admission(TOKEN, port), ClientMessages())
    try:
        assert websocket_server.serve is serve
        assert (server.get_host(), server.get_port()) == ("127.0.0.1", port)
        assert server.request_share_url() is None
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("GET", "/")
        assert connection.getresponse().status == 401
        connection.close()
    finally:
        server.stop()


def answer(port: int, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request("GET", path, headers=headers)
        response = connection.getresponse()
        response.read()
        return response
    finally:
        connection.close()


def test_every_answer_says_what_a_browser_may_do_with_it(free_port: Callable[[], int]) -> None:
    admission = Admission(TOKEN, free_port())
    server = viser_access.start(admission, ClientMessages())
    try:
        page = answer(admission.port, f"/?token={TOKEN}", Host="localhost:1")
        assert page.status == 200
        policy = "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; "
        policy += "connect-src 'self' ws://localhost:1 data: blob:; "
        policy += "frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
        assert page.headers.get_all("Content-Security-Policy") == [policy]
        assert page.headers.get_all("Referrer-Policy") == ["no-referrer"]
        assert page.headers.get_all("X-Content-Type-Options") == ["nosniff"]
        assert page.headers["Cache-Control"] == "no-store"
        assert page.headers.get_all("Set-Cookie") == [admission.cookie]
        refusal = answer(admission.port, "/")
        assert refusal.status == 401
        assert refusal.headers["Content-Type"] == "text/plain; charset=utf-8"
        assert refusal.headers["Cache-Control"] == "no-store"
        assert page.headers["Connection"] == refusal.headers["Connection"] == "close"
    finally:
        server.stop()


def test_a_page_of_our_own_stands_behind_the_same_door(free_port: Callable[[], int]) -> None:
    admission = Admission(TOKEN, free_port())
    page = viser_access.OwnPage(b"<p>ours</p>", "default-src 'none'; connect-src {websocket}")
    server = viser_access.start(admission, ClientMessages(), own_pages={"/own": page})
    own = {"Cookie": f"{admission.cookie_name}={TOKEN}"}
    try:
        shown = answer(admission.port, f"/own?token={TOKEN}", Host="localhost:1")
        assert shown.status == 200
        assert shown.headers["Content-Type"] == "text/html; charset=utf-8"
        assert shown.headers["Content-Length"] == "11"
        policy = "default-src 'none'; connect-src ws://localhost:1; "
        policy += "frame-ancestors 'none'; form-action 'none'; base-uri 'none'"
        assert shown.headers.get_all("Content-Security-Policy") == [policy]
        assert shown.headers.get_all("Set-Cookie") == [admission.cookie]
        assert shown.headers["Cache-Control"] == "no-store"
        assert answer(admission.port, "/own", **own).headers.get("Set-Cookie") is None
        assert answer(admission.port, "/own").status == 401
        assert answer(admission.port, "/own?token=wrong").status == 401
        assert answer(admission.port, "/own", Host="evil.example", **own).status == 421
        assert answer(admission.port, "/own", Origin="http://evil.example", **own).status == 403
    finally:
        server.stop()


def test_an_answer_that_the_guard_does_not_know_is_not_passed_on(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    answers: list[object] = []

    def wrapped(serve: Callable[..., Any], *arguments: Any, process_request: Any, **options: Any) -> Any:
        def pages(connection: object, request: object) -> object:
            return answers[0] if answers else process_request(connection, request)

        return serve(*arguments, process_request=pages, **options)

    _with_serve_changed(monkeypatch, wrapped)
    admission = Admission(TOKEN, free_port())
    server = viser_access.start(admission, ClientMessages())
    try:
        answers.append("a page by another way")
        assert answer(admission.port, f"/?token={TOKEN}").status == 500
    finally:
        server.stop()


def test_a_pad_is_served_by_its_own_door_whatever_its_query(free_port: Callable[[], int]) -> None:
    async def serve(connection: Any) -> None:
        await connection.send(f"a pad at {connection.request.path}")

    admission = Admission(TOKEN, free_port())
    server = viser_access.start(admission, ClientMessages(), {"/pointer": serve})
    try:
        for path in ("/pointer", f"/pointer?token={TOKEN}"):
            cookie = f"{admission.cookie_name}={TOKEN}"
            uri = f"ws://127.0.0.1:{admission.port}{path}"
            with connect(uri, additional_headers={"Cookie": cookie}, proxy=None) as pad:
                assert pad.recv(timeout=60) == f"a pad at {path}"
    finally:
        server.stop()


def test_a_websocket_from_the_network_is_closed_when_its_cookie_ends(
    free_port: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(viser_access, "_LOOK_AT_CLOCK_S", 0.01)
    day = [1.8e9]
    certificate, key = page_certificate(tmp_path, "127.0.0.1")
    login = OneTimeLogin()
    admission = LanAdmission(TOKEN, free_port(), host="127.0.0.1", login=login, clock=lambda: day[0])
    listener = LimitedListener("127.0.0.1", admission.port)
    lan = Lan(admission, listener, tls_of(certificate, key), "")

    async def serve(connection: Any) -> None:
        async for words in connection:
            await connection.send(f"{words} back")

    server = viser_access.start(Admission(TOKEN, free_port()), ClientMessages(), {"/pointer": serve}, lan)
    trusted = ssl.create_default_context(cafile=str(certificate))
    trusted.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    cookie = {"Cookie": admission.cookie.partition(";")[0]}
    uri = f"wss://{admission.place}/pointer"
    try:
        with TlsWire(uri, ssl=trusted, additional_headers=cookie) as pad:
            day[0] += LIFE_H * 3600 - 1.0
            for _ in range(10):  # some looks at the clock
                pad.send("there")
                assert pad.recv(timeout=60) == "there back"
            day[0] += 1.0
            with pytest.raises(ConnectionClosed) as closed:
                pad.recv(timeout=60)
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
    finally:
        server.stop()


def test_a_phone_that_reads_slowly_gets_the_whole_page(
    free_port: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Whoever has no more time than that is cut off before he has taken more than the socket holds.
    monkeypatch.setattr(viser_access, "_CLOSE_S", 0.0)
    certificate, key = page_certificate(tmp_path, "127.0.0.1")
    admission = LanAdmission(TOKEN, free_port(), host="127.0.0.1", login=OneTimeLogin(), clock=lambda: 1.8e9)
    listener = LimitedListener("127.0.0.1", admission.port)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 15)  # a slow link's: far less than the page
    lan = Lan(admission, listener, tls_of(certificate, key), "")
    server = viser_access.start(Admission(TOKEN, free_port()), ClientMessages(), lan=lan)
    trusted = ssl.create_default_context(cafile=str(certificate))
    trusted.verify_flags |= ssl.VERIFY_X509_PARTIAL_CHAIN
    phone = http.client.HTTPSConnection("127.0.0.1", admission.port, context=trusted, timeout=60)
    try:
        phone.request("GET", "/", headers={"Cookie": admission.cookie.partition(";")[0]})
        page = phone.getresponse()
        assert page.status == 200
        assert len(page.read()) == int(page.headers["Content-Length"]) > 1 << 18
    finally:
        phone.close()
        server.stop()


def test_the_environment_moves_it_to_no_other_port(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    port, elsewhere = free_port(), free_port()
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", str(elsewhere))
    server = viser_access.start(Admission(TOKEN, port), ClientMessages())
    try:
        assert server.get_port() == port
    finally:
        server.stop()


def test_half_a_request_is_no_news_and_everything_else_is(free_port: Callable[[], int]) -> None:
    log = logging.getLogger("websockets.server")
    server = viser_access.start(Admission(TOKEN, free_port()), ClientMessages())
    server.stop()

    def record(words: str) -> logging.LogRecord:
        return log.makeRecord(log.name, logging.ERROR, "", 0, words, (), None)

    assert not log.filter(record("opening handshake failed"))
    assert log.filter(record("connection handler failed"))


def test_controls_and_keys_are_known_by_visers_own_ids() -> None:
    handle: Any = types.SimpleNamespace(_impl=types.SimpleNamespace(uuid="its id"))
    assert viser_access.control_id(handle) == viser_access.key_id(handle) == "its id"


class Leaving:
    """A browser's task that leaves while somebody rings: as when another thread rings at the wrong instant."""

    def __init__(self, waiters: Any) -> None:
        self._waiters = waiters

    def done(self) -> bool:
        self._waiters.append(self)
        return True


@pytest.mark.parametrize("guarded", [False, True])
def test_a_page_is_written_from_another_thread_while_browsers_come_and_go(guarded: bool) -> None:
    """viser rings asyncio's bell from any thread: that raised into the panel's main loop, and ended it."""
    viser_access.ring_in_the_loop()
    loop = asyncio.new_event_loop()
    try:
        buffer: Any = AsyncMessageBuffer(loop, persistent_messages=True)
        if not guarded:
            buffer.message_event = asyncio.Event()
        waiters = buffer.message_event._waiters
        waiters.append(Leaving(waiters))
        if guarded:
            buffer.push(ResetGuiMessage())
            waiters.clear()
            loop.run_until_complete(asyncio.wait_for(buffer.message_event.wait(), 60.0))
        else:
            with pytest.raises(RuntimeError, match="deque mutated"):
                buffer.push(ResetGuiMessage())
    finally:
        loop.close()


def test_a_viser_with_another_bell_is_refused(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    monkeypatch.setattr(viser_access, "ring_in_the_loop", lambda: None)
    made = AsyncMessageBuffer.__init__
    monkeypatch.setattr(AsyncMessageBuffer, "__init__", getattr(made, "__wrapped__", made))
    with pytest.raises(viser_access.ViserIncompatible, match="bell"):
        viser_access.start(Admission(TOKEN, free_port()), ClientMessages())


def test_another_viser_is_refused(monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]) -> None:
    monkeypatch.setattr(viser, "__version__", "1.2.0")
    with pytest.raises(viser_access.ViserIncompatible, match=r"1\.2\.0"):
        viser_access.start(Admission(TOKEN, free_port()), ClientMessages())


def test_a_viser_that_serves_by_another_way_is_refused(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    # Its own reference to `serve`, so that the door is not passed.
    infra: Any = sys.modules["viser.infra._infra"]
    own = types.SimpleNamespace(
        asyncio=types.SimpleNamespace(server=types.SimpleNamespace(serve=websocket_server.serve)),
        exceptions=infra.websockets.exceptions,
        datastructures=infra.websockets.datastructures,
    )
    monkeypatch.setattr(infra, "websockets", own)
    port = free_port()
    with pytest.raises(viser_access.ViserIncompatible, match="served 0 times"):
        viser_access.start(Admission(TOKEN, port), ClientMessages())
    with pytest.raises(ConnectionRefusedError):
        http.client.HTTPConnection("127.0.0.1", port, timeout=60).connect()


def _with_serve_changed(monkeypatch: pytest.MonkeyPatch, change: Callable[..., Any]) -> None:
    infra: Any = sys.modules["viser.infra._infra"]

    class Server:
        def serve(self, *arguments: Any, **options: Any) -> Any:
            return change(websocket_server.serve, *arguments, **options)

    own = types.SimpleNamespace(
        asyncio=types.SimpleNamespace(server=Server()),
        exceptions=infra.websockets.exceptions,
        datastructures=infra.websockets.datastructures,
    )
    monkeypatch.setattr(infra, "websockets", own)


def start_in_vain(port: int) -> viser_access.ViserIncompatible:
    """Words that it says. Returns when viser's server thread has ended, so that no later test is blamed for that."""
    before = set(threading.enumerate())
    with pytest.raises(viser_access.ViserIncompatible) as refusal:
        viser_access.start(Admission(TOKEN, port), ClientMessages())
    for thread in set(threading.enumerate()) - before:
        if thread.name != "viser start":
            thread.join(60.0)
            assert not thread.is_alive()
    return refusal.value


@ends_a_thread
def test_a_viser_that_serves_all_interfaces_is_refused(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    def everywhere(serve: Callable[..., Any], handler: Any, host: str, port: int, **options: Any) -> Any:
        return serve(handler, "0.0.0.0", port, **options)

    _with_serve_changed(monkeypatch, everywhere)
    assert "0.0.0.0" in str(start_in_vain(free_port()))


@ends_a_thread
def test_a_viser_without_process_request_is_refused(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    def without(serve: Callable[..., Any], *arguments: Any, process_request: Any, **options: Any) -> Any:
        return serve(*arguments, **options)

    _with_serve_changed(monkeypatch, without)
    assert "process_request" in str(start_in_vain(free_port()))


def test_the_program_then_exits_with_one_line(tmp_path: Path, free_port: Callable[[], int]) -> None:
    program = (
        "import sys, viser; viser.__version__ = '2.0.0'; import web_panel.process as m; sys.exit(m.main())"
    )
    given = command("web_panel", PanelOptions(port=free_port(), token_file=tmp_path / "token"))[-1]
    ended = subprocess.run([sys.executable, "-c", program, given], capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1
    assert ended.stdout == ""
    assert len(ended.stderr.splitlines()) == 1
    assert ended.stderr.startswith("panel: viser 2.0.0")
