"""The front: what goes out to whom, the socket, the end."""

import math
import socket
import threading
import time

import pytest

from haptic_server.gateway.osc import name_resolution
from haptic_server.gateway.osc.osc_server import OscServer
from osc_bench import BOUND_S, RELEASE, STRIKE, FakeParameters, built, client, no_preset, opened_front, tell
from protocol import osc

P = "/drumstick"


def test_a_strike_and_its_mirrors_reach_every_target() -> None:
    with client() as a, client() as b, opened_front(FakeParameters(), a, b) as front:
        front.strike(STRIKE)
        for each in (a, b):
            assert each.waiting() == [
                ("/drumstick/strike", [9, 0.5, -0.25, 1.5, 0.75, 12.5]),
                ("/drumstick/level", [0.75]),
                ("/drumstick/x", [0.5]),
                ("/drumstick/y", [-0.25]),
                ("/drumstick/gate", [1]),
            ]


def test_a_release_closes_the_gate() -> None:
    with client() as a, opened_front(FakeParameters(), a) as front:
        front.release(RELEASE)
        assert a.waiting() == [
            ("/drumstick/release", [9, 1.25, 0.03125, 13.0, 0.0078125]),
            ("/drumstick/gate", [0]),
        ]


def test_alive_readback_and_error() -> None:
    with client() as a, opened_front(FakeParameters(), a) as front:
        front.alive("main", "fault: no device", 4)
        front.readback("dv_pls", 0.5, 0.25)
        front.error("/drumstick/x", "why")
        assert a.waiting() == [
            ("/drumstick/alive", ["main", "fault: no device", 4]),
            ("/drumstick/param/dv_pls", [0.5]),
            ("/drumstick/param/dv_pls/norm", [0.25]),
            ("/drumstick/error", ["/drumstick/x", "why"]),
        ]


def test_a_number_that_is_not_finite_is_never_sent() -> None:
    with client() as a, opened_front(FakeParameters(), a) as front:
        front.readback("z_h0", math.nan, math.nan)
        front.readback("z_h0", math.inf, 0.5)
        assert a.waiting() == []
        assert front.counters["unsendable"] == 2


def test_targets_that_cannot_be_reached_are_counted_and_the_others_served() -> None:
    parameters = FakeParameters()
    with client() as a:
        # Port 0 of a numeric address cannot be sent to on any system.
        front = OscServer(
            ("127.0.0.1", 0), [("127.0.0.1", 0), a.endpoint], P, parameters, parameters.load_preset
        )
        try:
            front.alive("main", "ready", 0)
            assert a.waiting() == [("/drumstick/alive", ["main", "ready", 0])]
            assert front.counters["send_failed"] == 1
        finally:
            front.close()


def test_sending_after_close_is_counted_not_raised() -> None:
    with client() as a, opened_front(FakeParameters(), a) as front:
        front.close()
        front.strike(STRIKE)
        assert front.counters["send_failed"] == 5


def test_over_the_socket() -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        a.udp.sendto(built(P + "/ping", 5), front.endpoint)
        assert a.next() == ("/drumstick/pong", [5])
        a.udp.sendto(bytes(9000), front.endpoint)
        assert a.next() == ("/drumstick/error", ["?", "longer than 1536 bytes"])
        a.udp.sendto(b"", front.endpoint)
        assert a.next()[0] == "/drumstick/error"
        a.udp.sendto(built(P + "/panic"), front.endpoint)
        assert parameters.panicked.wait(BOUND_S)


def test_a_taken_port_is_an_error() -> None:
    with opened_front(FakeParameters()) as front, pytest.raises(OSError, match="already in use"):
        OscServer(front.endpoint, [], P, FakeParameters(), no_preset)


def test_an_unusable_prefix_is_an_error_and_leaves_no_thread() -> None:
    before = set(threading.enumerate())
    with pytest.raises(ValueError, match="OSC prefix"):
        OscServer(("127.0.0.1", 0), [], "/a*", FakeParameters(), no_preset)
    assert set(threading.enumerate()) <= before  # one of another test may have ended meanwhile


def test_close_ends_the_thread_and_frees_the_port() -> None:
    with opened_front(FakeParameters()) as front:
        endpoint = front.endpoint
        assert "osc" in [t.name for t in threading.enumerate()]
        front.close()
        front.close()
        assert "osc" not in [t.name for t in threading.enumerate()]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as again:
            again.bind(endpoint)


def test_every_row_of_the_table_is_heard() -> None:
    parameters = FakeParameters()
    with opened_front(parameters) as front:
        named = {osc.address(P, row, name) for row in osc.INCOMING for name in parameters.table}
        assert front.addresses == named


def test_another_prefix() -> None:
    with client() as a:
        front = OscServer(("127.0.0.1", 0), [a.endpoint], "/kit/left", FakeParameters(), no_preset)
        try:
            assert tell(front, a, built("/kit/left/ping")) == [("/kit/left/pong", [])]
            assert tell(front, a, built("/drumstick/ping"))[0][0] == "/kit/left/error"
        finally:
            front.close()


def test_a_target_whose_name_nobody_knows_yet_holds_up_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    known, asked = threading.Event(), threading.Event()
    real = socket.getaddrinfo

    def answer(host: str, *words: int, flags: int = 0) -> object:
        if host != "light.stage" or flags & socket.AI_NUMERICHOST:
            return real(host, *words, flags=flags)
        asked.set()
        if not known.is_set():
            raise socket.gaierror(socket.EAI_AGAIN, "Temporary failure in name resolution")
        return real("127.0.0.1", *words)

    monkeypatch.setattr(name_resolution, "_AGAIN_S", 0.01)
    monkeypatch.setattr(socket, "getaddrinfo", answer)
    with client() as a, client() as b:
        front = OscServer(
            ("127.0.0.1", 0), [a.endpoint, ("light.stage", b.endpoint[1])], P, FakeParameters(), no_preset
        )
        try:
            assert asked.wait(BOUND_S)
            front.alive("main", "ready", 0)
            assert len(a.waiting()) == 1
            known.set()
            begun = time.monotonic()
            while not b.waiting() and time.monotonic() - begun < BOUND_S:
                front.alive("main", "ready", 0)
                time.sleep(0.01)
            front.alive("main", "ready", 1)
            assert b.waiting()[-1] == ("/drumstick/alive", ["main", "ready", 1])
        finally:
            front.close()
