"""The guard starts viser behind its door, or not at all. What comes through the door is tested in system/."""

import asyncio
import http.client
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

from web_panel import guard
from web_panel.admission import Admission
from web_panel.client_message import ClientMessages

TOKEN = "a" * 43
# viser's thread is ended by SystemExit, which Python passes over in silence and pytest reports.
ends_a_thread = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")


def test_it_starts_on_loopback_behind_the_door_and_leaves_no_trace(free_port: Callable[[], int]) -> None:
    serve = websocket_server.serve
    port = free_port()
    server = guard.start(Admission(TOKEN, port), ClientMessages())
    try:
        assert websocket_server.serve is serve
        assert (server.get_host(), server.get_port()) == ("127.0.0.1", port)
        assert server.request_share_url() is None
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
        connection.request("GET", "/")
        assert connection.getresponse().status == 401
        connection.close()
    finally:
        server.stop()


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
    guard.ring_in_the_loop()
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
            loop.run_until_complete(asyncio.wait_for(buffer.message_event.wait(), 10.0))
        else:
            with pytest.raises(RuntimeError, match="deque mutated"):
                buffer.push(ResetGuiMessage())
    finally:
        loop.close()


def test_a_viser_with_another_bell_is_refused(
    monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]
) -> None:
    monkeypatch.setattr(guard, "ring_in_the_loop", lambda: None)
    made = AsyncMessageBuffer.__init__
    monkeypatch.setattr(AsyncMessageBuffer, "__init__", getattr(made, "__wrapped__", made))
    with pytest.raises(guard.GuardError, match="bell"):
        guard.start(Admission(TOKEN, free_port()), ClientMessages())


def test_another_viser_is_refused(monkeypatch: pytest.MonkeyPatch, free_port: Callable[[], int]) -> None:
    monkeypatch.setattr(viser, "__version__", "1.2.0")
    with pytest.raises(guard.GuardError, match=r"1\.2\.0"):
        guard.start(Admission(TOKEN, free_port()), ClientMessages())


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
    with pytest.raises(guard.GuardError, match="served 0 times"):
        guard.start(Admission(TOKEN, port), ClientMessages())
    with pytest.raises(ConnectionRefusedError):
        http.client.HTTPConnection("127.0.0.1", port, timeout=10).connect()


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


def start_in_vain(port: int) -> guard.GuardError:
    """What it says. Returns when viser's server thread has ended, so that no later test is blamed for that."""
    before = set(threading.enumerate())
    with pytest.raises(guard.GuardError) as refusal:
        guard.start(Admission(TOKEN, port), ClientMessages())
    for thread in set(threading.enumerate()) - before:
        if thread.name != "viser start":
            thread.join(10.0)
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
        "import sys, viser; viser.__version__ = '2.0.0'; import web_panel.__main__ as m; sys.exit(m.main())"
    )
    arguments = ["--port", str(free_port()), "--token-file", str(tmp_path / "token")]
    ended = subprocess.run(
        [sys.executable, "-c", program, *arguments], capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 1
    assert ended.stdout == ""
    assert len(ended.stderr.splitlines()) == 1
    assert ended.stderr.startswith("panel: viser 2.0.0")
