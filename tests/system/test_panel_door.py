"""Admission by raw HTTP and raw websockets, and what a hostile program that has the token can do: no harm."""

import http.client
import json
import re
import signal
import socket
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fake_rig import FakeRig, wait_until
from panel_process import PanelProcess, arguments, panel
from panel_wire import Visitor, dial_port
from rig_process import PATIENCE_S
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.connection import Connection


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


def get(served: PanelProcess, path: str, **headers: str) -> http.client.HTTPResponse:
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=PATIENCE_S)
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    response.read()
    connection.close()
    return response


def status_of(served: PanelProcess, request: bytes) -> int:
    """HTTP status that a request, as raw bytes, gets."""
    with socket.create_connection(("127.0.0.1", served.port), timeout=PATIENCE_S) as connection:
        connection.sendall(request)
        return int(connection.makefile("rb").readline().split()[1])


def dial(served: PanelProcess, origin: str | None = None, path: str = "/", **headers: str) -> Connection:
    return dial_port(served.port, origin, path, **headers)


def test_pages(served: PanelProcess) -> None:
    own = f"http://127.0.0.1:{served.port}"
    by_address = f"/?token={served.token}"
    assert get(served, "/").status == 401
    assert get(served, "/?token=wrong").status == 401
    assert get(served, "/index.html").status == 401
    host = b"Host: 127.0.0.1:%d\r\n" % served.port
    for line in (b"GET /?token=\xe4\xff HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nCookie: %s=\xff\r\n"):
        start = line % served.cookie.partition("=")[0].encode() if b"%s" in line else line
        assert status_of(served, start + host + b"\r\n") in (400, 401)
    assert get(served, "/", Cookie=served.cookie).status == 200
    assert get(served, by_address, Origin=own).status == 200
    assert get(served, by_address, Origin="http://evil.example").status == 403
    assert get(served, "/", Origin="null", Cookie=served.cookie).status == 403
    assert get(served, by_address, Host="evil.example").status == 421
    assert get(served, by_address, Host=f"evil.example:{served.port}").status == 421
    assert get(served, "/../../etc/passwd", Cookie=served.cookie).status == 404
    stage = f"/stage?token={served.token}"
    assert get(served, stage).status == get(served, "/stage", Cookie=served.cookie, Origin=own).status == 200
    assert get(served, "/stage").status == get(served, "/stage?token=wrong").status == 401
    assert get(served, stage, Origin="http://evil.example").status == 403
    assert get(served, stage, Host="evil.example").status == 421


def test_the_page_sets_the_cookie_and_forbids_other_machines(served: PanelProcess) -> None:
    response = get(served, f"/?token={served.token}")
    cookie = response.getheader("Set-Cookie", "")
    assert cookie.startswith(served.cookie + ";")
    assert {"HttpOnly", "SameSite=Strict"} <= set(cookie.split("; "))
    policy = response.getheader("Content-Security-Policy", "")
    assert "frame-ancestors 'none'" in policy
    assert not re.search(r"https?:", policy)
    assert get(served, "/", Cookie=served.cookie).getheader("Set-Cookie") is None


@pytest.mark.parametrize(
    ("status", "origin", "headers"),
    [
        (401, None, {}),
        (401, "own", {}),
        (401, None, {"Cookie": "drumstick_panel_1=wrong"}),
        (403, "http://evil.example", {"Cookie": "right"}),
        (403, "null", {"Cookie": "right"}),
        (421, None, {"Cookie": "right", "Host": "evil.example"}),
    ],
)
def test_websockets(served: PanelProcess, status: int, origin: str | None, headers: dict[str, str]) -> None:
    given = {k: served.cookie if v == "right" else v for k, v in headers.items()}
    own = f"http://127.0.0.1:{served.port}"
    for path in ("/", "/pointer", "/stage/state"):
        with pytest.raises(InvalidStatus) as refused:
            dial(served, own if origin == "own" else origin, path, **given).close()
        assert refused.value.response.status_code == status


RUBBISH = (
    "",
    "[",
    "[true]",
    "[true, 2, 0]",
    "[true, NaN, 0]",
    "[1, 0, 0]",
    '["x", 0, 0]',
    b"\x00",
    "9" * 300,
)


def heard_pad(served: PanelProcess, rig: FakeRig) -> Connection:
    """A pad of a panel that has found its rig, held by nobody."""
    pad = dial(served, path="/pointer", Cookie=served.cookie)

    def heard() -> bool:
        pad.send("[true, 1, 0]")
        pad.send("[false, 1, 0]")
        return bool(rig.pointers) and not rig.pointers[-1].held

    wait_until(heard, "a panel that has found its rig")
    # Frames of one pad come in order: after these two, none of those above is still under way.
    pad.send("[true, 0.125, 0]")
    wait_until(
        lambda: rig.pointers[-1].held and rig.pointers[-1].lift == 0.125, "the last frame that is held"
    )
    pad.send("[false, 0.125, 0]")
    wait_until(lambda: not rig.pointers[-1].held, "the frame that lets go")
    rig.pointers.clear()
    return pad


def test_a_pad_that_speaks_rubbish_points_at_nothing(served: PanelProcess, rig: FakeRig) -> None:
    pad = heard_pad(served, rig)
    for rubbish in RUBBISH:
        pad.send(rubbish)
    pad.send("[true, 0.25, -0.5]")
    wait_until(lambda: rig.pointers, "the one good frame")
    assert [(p.held, p.lift, p.x, p.y) for p in rig.pointers] == [(True, 0.25, -0.5, 0.0)]
    pad.close()
    wait_until(lambda: len(rig.pointers) == 2, "the pad's end")
    assert not rig.pointers[-1].held
    assert rig.pointers[-1].source == rig.pointers[0].source


def test_a_pad_that_floods_is_thinned_and_cut_and_has_then_let_go(served: PanelProcess, rig: FakeRig) -> None:
    pad = heard_pad(served, rig)
    begun = time.monotonic()
    with pytest.raises(ConnectionClosed, match="too many messages"):  # noqa: PT012  when it is noticed varies
        for i in range(100_000):
            pad.send(f"[true, {i / 100_000}, 0]")
        pad.recv(timeout=PATIENCE_S)
    wait_until(lambda: rig.pointers and not rig.pointers[-1].held, "the last word")
    assert 1 < len(rig.pointers) <= 3 + (time.monotonic() - begun) / 0.004


def test_so_many_pads_and_no_more(served: PanelProcess) -> None:
    pads = [dial(served, path="/pointer", Cookie=served.cookie) for _ in range(16)]
    one_too_many = dial(served, path="/pointer", Cookie=served.cookie)
    with pytest.raises(ConnectionClosed) as closed:
        one_too_many.recv(timeout=PATIENCE_S)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1013
    for pad in pads:
        pad.close()


@pytest.mark.parametrize("spoken", ["", "[0, 0, 1]", b"\x00", b"\x00" * 1_000_000])
def test_a_stage_page_that_says_anything_is_closed(
    served: PanelProcess, rig: FakeRig, spoken: str | bytes
) -> None:
    stage = dial(served, path="/stage/state", Cookie=served.cookie)
    assert "words" in json.loads(stage.recv(timeout=PATIENCE_S))
    with pytest.raises(ConnectionClosed) as closed:  # noqa: PT012  the frame may be refused while it is sent
        stage.send(spoken)
        while True:
            stage.recv(timeout=PATIENCE_S)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == (1009 if len(spoken) > 16_384 else 1008)
    assert (rig.sets, rig.pointers, rig.panics) == ([], [], 0)


def test_dead_stage_pages_hold_up_neither_the_others_nor_the_page(served: PanelProcess, rig: FakeRig) -> None:
    dead = [dial(served, path="/stage/state", Cookie=served.cookie) for _ in range(7)]
    seen = dial(served, path="/stage/state", Cookie=served.cookie)
    one_too_many = dial(served, path="/stage/state", Cookie=served.cookie)
    with pytest.raises(ConnectionClosed) as closed:
        one_too_many.recv(timeout=PATIENCE_S)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1013
    with dial(served, f"http://127.0.0.1:{served.port}", Cookie=served.cookie) as wire:
        honest = Visitor(wire)
        slider = honest.find("GuiSliderMessage", "Δv_pls")
        honest.update(slider, value=0.3)
        wait_until(lambda: rig.sets, "the honest user's wish")
    places: list[object] = []

    def are_shown() -> bool:
        places.append(json.loads(seen.recv(timeout=PATIENCE_S))["places"])
        return sum(map(bool, places)) > 10

    wait_until(are_shown, "eleven frames with places")
    seen.close()
    for each in dead:
        each.socket.shutdown(socket.SHUT_RDWR)  # a farewell would wait for an answer that nobody reads


def test_it_listens_on_loopback_only(served: PanelProcess) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))  # sends nothing; tells this machine's own address
        own = str(probe.getsockname()[0])
    if own.startswith("127."):
        pytest.fail("this machine has no other address than loopback to try")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((own, served.port), timeout=PATIENCE_S).close()


def test_what_a_hostile_client_sends_goes_nowhere(own_rig: FakeRig, own_panel: PanelProcess) -> None:
    rig, served = own_rig, own_panel
    with dial(served, f"http://127.0.0.1:{served.port}", Cookie=served.cookie) as wire:
        hostile = Visitor(wire)
        slider = hostile.find("GuiSliderMessage", "Δv_pls")
        button = hostile.find("GuiButtonMessage", "PANIC")
        wire.send("text")
        wire.send(b"\xc1\x00")
        writes: tuple[dict[str, Any], ...] = (
            {"update_cb": []},
            {"value": 0.3, "update_cb": []},
            {"props": {}},
            {"removed": True},
        )
        for updates in writes:
            hostile.update(slider, **updates)
            hostile.update(button, **updates)
        for value in (float("nan"), float("inf"), "0.3", [0.3], None, True):
            hostile.update(slider, value=value)
        hostile.send(type="ShareUrlRequest")
        hostile.send(type="RunJavascriptMessage", source="alert(1)")
        hostile.update(slider, value=1e9)
        hostile.update(slider, value=-1.0)
        # Only this one is a wish; that it arrives shows that all before it were read and that the slider still lives.
        hostile.update(slider, value=0.3)
        wait_until(lambda: rig.sets, "the one honest wish")
        assert rig.sets == [("dv_pls", 0.3)]
        hostile.update(button, value=True)
        wait_until(lambda: rig.panics, "the panic")
        assert served.process.poll() is None
    assert served.stop() == 0
    assert served.further_lines() == []


def read_on(socket: Connection) -> None:
    """For ever, or until it raises."""
    while True:
        socket.recv(timeout=PATIENCE_S)


def pour(visitor: Visitor, uuid: str) -> None:
    """Ten thousand messages, and then on until the connection ends."""
    for number in range(10_000):
        visitor.update(uuid, value=1e9 + number)
    while True:
        visitor.read()


@pytest.mark.long
def test_floods_and_giants_leave_the_honest_user_his_page(rig: FakeRig, served: PanelProcess) -> None:
    """A megabyte in one frame, and ten thousand messages at once, end their own connection only."""
    own = f"http://127.0.0.1:{served.port}"
    with dial(served, own, Cookie=served.cookie) as wire, dial(served, own, Cookie=served.cookie) as flood:
        honest, hostile = Visitor(wire), Visitor(flood)
        slider = honest.find("GuiSliderMessage", "Δv_pls")
        with dial(served, own, Cookie=served.cookie) as giant:
            giant.send(b"\x00" * 1_000_000)
            with pytest.raises(ConnectionClosed):
                read_on(giant)
        with pytest.raises(ConnectionClosed, match="too many messages"):
            pour(hostile, slider)
        honest.update(slider, value=0.3)
        wait_until(lambda: rig.sets, "the honest user's wish")
        assert rig.sets == [("dv_pls", 0.3)]
    assert served.process.poll() is None


def test_a_taken_port_is_said_in_one_line(rig: FakeRig, tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = int(taken.getsockname()[1])
        ended = subprocess.run(
            arguments(rig.endpoint, port, tmp_path / "token"),
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
    assert ended.returncode == 3
    assert len(ended.stderr.splitlines()) == 1
    assert str(port) in ended.stderr
    assert ended.stdout == ""


@pytest.mark.parametrize("wrong", [{"rig": "a/b"}, {"port": "eighty"}])
def test_a_wrong_argument_is_status_2(tmp_path: Path, wrong: dict[str, str]) -> None:
    *command, options = arguments("tcp/127.0.0.1:1", 0, tmp_path / "token")
    given = json.dumps({**json.loads(options), **wrong})
    ended = subprocess.run([*command, given], capture_output=True, text=True, timeout=PATIENCE_S)
    assert ended.returncode == 2
    assert next(iter(wrong.values())) in ended.stderr or "$.port" in ended.stderr
    assert len(ended.stderr.splitlines()) == 1


@pytest.mark.long
def test_a_restart_keeps_the_address(rig: FakeRig, tmp_path: Path, free_port: Callable[[], int]) -> None:
    port = free_port()
    with panel(rig.endpoint, port, tmp_path / "token") as first:
        address, cookie = first.address, first.cookie
        first.process.kill()
        first.process.wait()
    with panel(rig.endpoint, port, tmp_path / "token") as second:
        assert second.address == address
        assert get(second, "/", Cookie=cookie).status == 200


@pytest.mark.parametrize("by", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.daily("15")
def test_it_ends_cleanly_with_visitors_and_without_a_router(
    tmp_path: Path, free_port: Callable[[], int], by: signal.Signals
) -> None:
    with panel(f"tcp/127.0.0.1:{free_port()}", free_port(), tmp_path / "token") as lonely:
        wire = dial(lonely, Cookie=lonely.cookie)
        assert wire.recv(timeout=PATIENCE_S)
        assert lonely.stop(by) == 0
        wire.close()
    assert lonely.further_lines() == []
