"""The thread between the relay and a port: order, what is dropped, panic, the end, ports that come and go."""

import logging
import math
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from haptic_server.gateway.midi import sender as senders
from haptic_server.gateway.midi.encoding import Voice, velocity
from haptic_server.gateway.midi.sender import MidiSender
from osc_bench import BOUND_S, Time
from protocol.messages import Strike

OFF, X, Y, ON = 0x89, 0xB9, 0xB9, 0x99
SILENCE = [(OFF, 38, 64), (0xB9, 123, 0)]


def strike(seq: int = 1, level: float = 0.5, x: float = 0.0, y: float = 0.0) -> Strike:
    return Strike(
        boot=1, seq=seq, t_ns=5, x=x, y=y, z_speed_m_per_s=1.0, level=level, peak_estimate_N=1.0,
        contact_estimate_s=0.005,
    )  # fmt: skip


class FakePort:
    """Remembers what it was sent; may be away, and may hold the sender up."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, ...]] = []
        self.is_open = True
        self.closed = threading.Event()
        self.looked = threading.Event()
        self.news = ""
        self.may_go_on = threading.Event()
        self.may_go_on.set()
        self.is_held = threading.Event()

    def poll(self, now_s: float) -> str:
        self.looked.set()
        news, self.news = self.news, ""
        return news

    def send(self, messages: bytes) -> bool:
        self.is_held.set()
        assert self.may_go_on.wait(BOUND_S)
        if self.is_open:
            self.sent += [tuple(messages[i : i + 3]) for i in range(0, len(messages), 3)]
        return self.is_open

    def close(self) -> None:
        self.closed.set()

    def notes(self) -> list[tuple[int, ...]]:
        return [message for message in self.sent if message[0] == ON]


def until(what: Callable[[], object]) -> None:
    end = time.monotonic() + BOUND_S
    while not what():
        assert time.monotonic() < end
        time.sleep(0.001)


@contextmanager
def sending(port: FakePort, now: Callable[[], float] = time.monotonic) -> Iterator[MidiSender]:
    sender = MidiSender(Voice(), port, now)
    try:
        yield sender
    finally:
        port.may_go_on.set()
        sender.close()


def test_a_strike_and_its_release() -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        sender.strike(strike(level=1.0, x=-1.0, y=1.0))
        sender.release()
        until(lambda: len(port.sent) == 4)
        assert port.sent == [(X, 16, 0), (Y, 17, 127), (ON, 38, 127), (OFF, 38, 64)]


def test_places_are_sent_when_they_change() -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        for x, y in ((0.0, 0.0), (0.0, 0.0), (0.5, 0.0), (0.5, -1.0)):
            sender.strike(strike(x=x, y=y))
            sender.release()
        until(lambda: port.sent.count((OFF, 38, 64)) == 4)
        controls = [message for message in port.sent if message[0] == X]
        assert controls == [(X, 16, 64), (Y, 17, 64), (X, 16, 95), (Y, 17, 0)]


def test_a_strike_before_the_release_ends_the_note_before() -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        sender.strike(strike(level=0.0))
        sender.strike(strike(level=1.0))
        sender.release()
        sender.release()
        until(lambda: (OFF, 38, 64) in port.sent[-1:])
        sounding = [message for message in port.sent if message[0] != X]
        assert sounding == [(ON, 38, 1), (OFF, 38, 64), (ON, 38, 127), (OFF, 38, 64)]


def test_a_full_queue_drops_its_oldest_and_counts_and_nobody_waits() -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        port.may_go_on.clear()
        sender.strike(strike(level=1.0))
        assert port.is_held.wait(BOUND_S)
        more = senders.MAX_QUEUED // 2 + 50
        for i in range(more):  # returns, though the port stands still
            sender.strike(strike(level=i / more))
            sender.release()
        assert sender.counters["dropped"] == 2 * more - senders.MAX_QUEUED
        port.may_go_on.set()
        until(lambda: sender.counters.get("notes") == 1 + senders.MAX_QUEUED // 2)
        newest = [velocity(i / more) for i in range(more)][-senders.MAX_QUEUED // 2 :]
        until(lambda: port.sent[-1] == (OFF, 38, 64))
        assert [note[2] for note in port.notes()] == [127, *newest]


def test_what_is_late_is_not_played() -> None:
    port, now = FakePort(), Time()
    with sending(port, now) as sender:
        port.may_go_on.clear()
        sender.strike(strike(level=1.0))
        assert port.is_held.wait(BOUND_S)
        sender.strike(strike(level=0.0))
        sender.release()
        now.s += senders.LATE_S * 1.01
        sender.strike(strike(level=0.5))
        port.may_go_on.set()
        until(lambda: sender.counters.get("notes") == 2)
        assert [note[2] for note in port.notes()] == [127, 64]
        assert sender.counters["late"] == 1
        assert (OFF, 38, 64) in port.sent  # a note's end is never late


def test_what_is_struck_while_the_port_is_away_is_not_played_later(caplog: pytest.LogCaptureFixture) -> None:
    port = FakePort()
    port.is_open = False
    port.news = "no port has 'x' in its name"
    with caplog.at_level(logging.WARNING), sending(port, Time()) as sender:
        for _ in range(5):
            sender.strike(strike())
            sender.release()
        until(lambda: sender.counters.get("away") == 10)
        assert sender.counters["open"] == 0
        port.looked.clear()
        port.is_open = True
        assert port.looked.wait(BOUND_S)
        sender.strike(strike(level=1.0))
        until(port.notes)
        assert [note[2] for note in port.notes()] == [127]
    assert [r.message for r in caplog.records] == ["midi: no port has 'x' in its name"]


def test_a_port_that_comes_back_is_told_the_place_again() -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        sender.strike(strike())
        until(port.notes)
        port.is_open = False
        sender.release()
        until(lambda: sender.counters.get("away") == 1)
        port.sent.clear()
        for _ in range(2):  # the second look begins after what follows the first has ended
            port.looked.clear()
            assert port.looked.wait(BOUND_S)
        port.is_open = True
        port.looked.clear()
        assert port.looked.wait(BOUND_S)
        sender.strike(strike())
        until(port.notes)
        assert port.sent == [(X, 16, 64), (Y, 17, 64), (ON, 38, 64)]


@pytest.mark.parametrize("state", ["panic", "fault: no device"])
def test_panic_and_fault_end_every_note_once(state: str) -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        for words in ("ready", "playing"):
            sender.status(words)
        sender.strike(strike())
        until(port.notes)
        for _ in range(30):
            sender.status(state)
        until(lambda: port.sent[-2:] == SILENCE)
        sender.status("playing")
        sender.strike(strike(level=1.0))
        until(lambda: len(port.notes()) == 2)
        assert port.sent.count((0xB9, 123, 0)) == 1


def test_the_end_silences_and_closes_the_port(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(senders, "_JOIN_S", BOUND_S)
    port = FakePort()
    with sending(port, Time()) as sender:
        sender.strike(strike())
    assert port.sent[-3:] == [(ON, 38, 64), *SILENCE]
    assert port.closed.is_set()
    sender.close()


@pytest.mark.parametrize("broken", [{"level": math.nan}, {"x": math.inf}, {"y": math.nan}])
def test_a_number_that_is_not_finite_is_never_sent(
    broken: dict[str, float], caplog: pytest.LogCaptureFixture
) -> None:
    port = FakePort()
    with sending(port, Time()) as sender:
        for _ in range(3):
            sender.strike(strike(**broken))
        sender.strike(strike(level=1.0))
        until(port.notes)
        assert [note[2] for note in port.notes()] == [127]
        assert sender.counters["unsendable"] == 3
    assert len(caplog.records) == 1
