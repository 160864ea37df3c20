"""Notices that a supervisor hears, and silence."""

import logging
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from realtime.notify import Supervisor


class Ear:
    """A datagram socket as systemd's, and a clock of the test's own."""

    def __init__(self, address: str) -> None:
        self.now_s = 100.0
        self.address = address
        self._supervisors: list[Supervisor] = []
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind("\0" + address[1:] if address.startswith("@") else address)
        self._socket.setblocking(False)

    def heard(self) -> list[list[str]]:
        found: list[list[str]] = []
        while True:
            try:
                found.append(self._socket.recv(4096).decode().split("\n"))
            except BlockingIOError:
                return found

    def close(self) -> None:
        self._socket.close()

    def end(self) -> None:
        self.close()
        for each in self._supervisors:  # in a process they are open until it ends
            assert each._socket is not None
            each._socket.close()

    def supervisor(self, **more: str) -> Supervisor:
        made = Supervisor({"NOTIFY_SOCKET": self.address, **more}, lambda: self.now_s)
        self._supervisors.append(made)
        return made


@pytest.fixture(params=["file", "abstract"])
def ear(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Ear]:
    made = Ear(str(tmp_path / "notify") if request.param == "file" else f"@drumstick-test-{os.getpid()}")
    yield made
    made.end()


def test_ready_comes_first_and_only_once(ear: Ear) -> None:
    told = ear.supervisor(WATCHDOG_USEC="4000000", WATCHDOG_PID=str(os.getpid()))
    told.notify_alive("it\nplays")
    assert ear.heard() == [["READY=1", "STATUS=it plays"]]
    told.notify_alive("and feeds the watchdog")
    assert ear.heard() == [["WATCHDOG=1", "STATUS=and feeds the watchdog"]]
    told.notify_alive("again, too soon")
    assert ear.heard() == []
    ear.now_s += 1.01  # a quarter of the watchdog's time
    told.notify_alive("on")
    assert ear.heard() == [["WATCHDOG=1", "STATUS=on"]]


def test_who_waits_asks_for_time_until_it_is_ready(ear: Ear) -> None:
    told = ear.supervisor()
    told.notify_waiting("for a router")
    told.notify_waiting("for a router")
    ((first, status),) = ear.heard()
    name, _, micros = first.partition("=")
    assert (name, status) == ("EXTEND_TIMEOUT_USEC", "STATUS=for a router")
    assert int(micros) >= 2 * 5_000_000  # before it runs out, another comes
    ear.now_s += 5.01
    told.notify_waiting("for a router")
    assert len(ear.heard()) == 1
    told.notify_alive("there")
    ear.now_s += 100.0
    told.notify_waiting("never again")
    assert [lines[0] for lines in ear.heard()] == ["READY=1"]


def test_trouble_feeds_nobody(ear: Ear) -> None:
    ear.supervisor(WATCHDOG_USEC="4000000").notify_trouble("the loop stands still")
    assert ear.heard() == [["STATUS=the loop stands still"]]


def test_somebody_elses_watchdog_is_not_ours_to_feed(ear: Ear) -> None:
    told = ear.supervisor(WATCHDOG_USEC="4000000", WATCHDOG_PID="1")
    for _ in range(2):
        told.notify_alive("")
    assert len(ear.heard()) == 2
    ear.now_s += 4.0
    told.notify_alive("")
    assert ear.heard() == []  # the pace of a process that nobody watches


def test_nothing_is_opened_where_nobody_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "socket", lambda *_: pytest.fail("a socket was opened"))
    told = Supervisor({})
    told.notify_alive("")
    told.notify_waiting("")
    told.notify_trouble("")
    assert not told.is_due


def test_a_supervisor_that_went_away_is_told_of_once(ear: Ear, caplog: pytest.LogCaptureFixture) -> None:
    told = ear.supervisor(WATCHDOG_USEC="4000000")
    ear.close()
    if not ear.address.startswith("@"):
        Path(ear.address).unlink()
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            told.notify_alive("on")
            ear.now_s += 2.0
    assert len(caplog.records) == 1
