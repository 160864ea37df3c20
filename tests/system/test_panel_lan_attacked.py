"""The page on the network under attack: each is refused, an honest visitor is served meanwhile, and places come back.

At its full length, on a real rig: drumstick lab panel-attack.
"""

import os
import socket
import ssl
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from fake_rig import FakeRig, wait_until
from lan_page import Opened, when_there_is_a_place
from panel_wire import Visitor
from rig_process import PATIENCE_S
from websockets.exceptions import ConnectionClosed

from rig.machine.machine_needs import FILES
from tls_wire import TlsWire
from web_panel.access.lan_listener import IN_ALL, OF_ONE, STRANGERS

pytestmark = pytest.mark.system
HONEST, WILD, STRANGER = "127.0.0.3", "127.0.0.10", "127.0.0.99"


@pytest.fixture(scope="module")
def cookie(lan: Opened) -> str:
    return lan.get(lan.word())[1]


@pytest.fixture(scope="module")
def honest(lan: Opened, cookie: str) -> Iterator[tuple[TlsWire, str]]:
    """An honest visitor's page that is open throughout, and its PANIC."""
    with lan.dial(lan.origin, HONEST, Cookie=cookie) as wire:
        visitor = Visitor(wire)
        button = visitor.find("GuiButtonMessage", "PANIC")
        visitor.read_on()
        yield wire, button


@pytest.fixture
def rig(faked: FakeRig) -> FakeRig:
    faked.begin_again()
    return faked


def is_heard(rig: FakeRig, wire: TlsWire, button: str) -> None:
    before = rig.panics
    Visitor(wire).update(button, value=True)
    wait_until(lambda: rig.panics > before, "the honest visitor's PANIC")


def descriptors(lan: Opened) -> int:
    return len(os.listdir(f"/proc/{lan.inner.process.pid}/fd"))


@pytest.mark.parametrize("path", ["/", "/stage", "/?login=wrong", "/?token={token}", "/?login={used}"])
def test_each_of_many_without_a_login_is_refused(
    lan: Opened, rig: FakeRig, honest: tuple[TlsWire, str], path: str
) -> None:
    used = ""
    if "used" in path:
        used = lan.word()
        assert lan.get(used)[0] == 200
    asked = path.format(token=lan.inner.token, used=used.partition("=")[2])
    assert [lan.get(asked, WILD) for _ in range(20)] == [(401, "")] * 20
    is_heard(rig, *honest)


def test_a_link_that_another_one_replaced_admits_nobody(lan: Opened) -> None:
    replaced, newest = lan.word(), lan.word()
    assert lan.get(replaced) == (401, "")
    assert lan.get(newest)[0] == 200


def closed_places(kept: Sequence[socket.socket]) -> int:
    """Number of these connections that were closed at once."""
    found = 0
    for each in kept:
        each.setblocking(False)
        try:
            found += not each.recv(1)
        except ConnectionResetError:
            found += 1
        except (BlockingIOError, ssl.SSLWantReadError):
            continue
    return found


@pytest.mark.parametrize("begun", [b"", bytes.fromhex("16030102000100")], ids=["tcp", "handshake"])
def test_all_places_are_taken_and_who_is_in_is_heard(
    lan: Opened, rig: FakeRig, honest: tuple[TlsWire, str], cookie: str, begun: bytes
) -> None:
    """From so many addresses that no stranger comes in until they leave; who came in before, does."""
    before = descriptors(lan)
    assert before + IN_ALL < FILES
    many: list[socket.socket] = []
    try:
        for _ in range(5):  # places end after some seconds: on a busy machine before the stranger comes
            new = [lan.tcp(f"127.0.0.{20 + i // 20}") for i in range(100)]
            many += new
            for each in new:
                with suppress(OSError):  # those without a place are closed
                    each.sendall(begun)
            try:
                lan.get_once("/", STRANGER, {})
            except OSError:
                break
        else:
            pytest.fail("a stranger always comes in")
        assert descriptors(lan) <= before + STRANGERS
        is_heard(rig, *honest)
        with lan.dial_once(lan.origin, HONEST, {"Cookie": cookie}) as again:
            is_heard(rig, again, honest[1])
    finally:
        for each in many:
            each.close()
    assert lan.get("/", STRANGER)[0] == 401
    wait_until(lambda: descriptors(lan) <= before, "the places")


def resident(lan: Opened) -> float:
    """Memory, MB."""
    lines = Path(f"/proc/{lan.inner.process.pid}/status").read_text().splitlines()
    return next(float(line.split()[1]) / 1e3 for line in lines if line.startswith("VmRSS"))


def test_a_message_that_never_ends_fills_no_memory(
    lan: Opened, rig: FakeRig, honest: tuple[TlsWire, str], cookie: str
) -> None:
    before_MB, pieces = resident(lan), b"\x00\x80\0\0\0\0" * 1000
    with ExitStack() as kept:
        for wire in [kept.enter_context(lan.websocket(cookie, WILD)) for _ in range(4)]:
            wire.sendall(b"\x02\x80\0\0\0\0")
            with pytest.raises(OSError):  # noqa: PT011, PT012  the other end is gone, as TLS or TCP says it
                for _ in range(30):
                    wire.sendall(pieces)
                    is_heard(rig, *honest)
        assert resident(lan) < before_MB + 30.0


def test_a_megabyte_and_a_flood_end_their_own_connection(
    lan: Opened, rig: FakeRig, honest: tuple[TlsWire, str], cookie: str
) -> None:
    def giant(wire: TlsWire) -> None:
        wire.send(bytes(1_000_000))

    def flood(wire: TlsWire) -> None:
        for number in range(10_000):
            Visitor(wire).update("nothing", value=number)

    ends: tuple[tuple[int, Callable[[TlsWire], None]], ...] = ((1009, giant), (1008, flood))
    for code, attack in ends:
        with lan.dial(lan.origin, WILD, Cookie=cookie) as wire:
            with pytest.raises(ConnectionClosed) as closed:  # noqa: PT012  while it sends or when it reads on
                attack(wire)
                for _ in range(300):
                    wire.recv(timeout=PATIENCE_S)
            # None where TLS ended before the words were read: asyncio resets what comes after its end.
            assert closed.value.rcvd is None or closed.value.rcvd.code == code
        is_heard(rig, *honest)


@pytest.mark.long
def test_who_sends_his_request_by_and_by_loses_his_place(lan: Opened, cookie: str) -> None:
    with ExitStack() as kept:
        slow: list[ssl.SSLSocket] = []
        for _ in range(5):  # places end after some seconds: on a busy machine before the last is taken
            for _ in range(OF_ONE - len(slow) + closed_places(slow)):
                slow.append(kept.enter_context(when_there_is_a_place(lambda: lan.shaken(WILD))))
                slow[-1].sendall(f"GET / HTTP/1.1\r\nHost: {lan.place}\r\nX-Slow: ".encode())
            try:
                lan.get_once("/", WILD, {"Cookie": cookie})
            except OSError:  # of TLS or of TCP, as it comes
                break
        else:
            pytest.fail("one more always comes in")
        assert lan.get("/stage", HONEST, Cookie=cookie)[0] == 200
        wait_until(lambda: closed_places(slow) == len(slow), "their end")
        assert lan.get("/stage", WILD, Cookie=cookie)[0] == 200
