"""Rigs that come and go: who is played, who has to wait, who is let go."""

import logging
import threading
from collections.abc import Callable

import pytest

from protocol.keys import Keys
from realtime.stop import StopRequest
from sound_server.receiving.discovery import LET_GO_S, Presences
from sound_server.roster import Roster


class Players:
    """Players of a roster: each until it is asked to stop, and may then go on."""

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.stops: dict[str, StopRequest] = {}
        self.may_end: dict[str, threading.Event] = {}
        self.threads: dict[str, threading.Thread] = {}

    def __call__(self, rig: str, stop: StopRequest) -> None:
        self.threads[rig] = threading.current_thread()
        self.stops[rig] = stop
        self.may_end[rig] = threading.Event()
        self.begun.append(rig)
        self.may_end[rig].wait(60.0)

    def end(self, rig: str) -> None:
        self.may_end[rig].set()
        self.threads[rig].join(60.0)

    def end_all(self) -> None:
        for rig in self.may_end:
            self.end(rig)


def begun(players: Players, *rigs: str) -> None:
    pause = threading.Event()
    for _ in range(6000):
        if sorted(players.begun) == sorted(rigs):
            return
        pause.wait(0.01)
    raise AssertionError((players.begun, rigs))


def test_named_rigs_play_always_and_others_while_they_are_there() -> None:
    players = Players()
    roster = Roster(["a", "b"], 8, players)
    begun(players, "a", "b")
    roster.follow(["a", "x"])
    begun(players, "a", "b", "x")
    roster.follow(["b"])
    assert [players.stops[rig].is_set() for rig in ("a", "b", "x")] == [False, False, True]
    assert not roster.is_broken
    players.end("x")
    roster.follow([])
    assert roster.rigs == ["a", "b"]
    assert not roster.is_broken
    players.end_all()
    roster.close()


def test_a_rig_that_is_back_before_its_drum_has_faded_gets_a_new_one_afterwards() -> None:
    players = Players()
    roster = Roster([], 8, players)
    roster.follow(["x"])
    begun(players, "x")
    roster.follow([])
    roster.follow(["x"])
    assert players.begun == ["x"]
    assert players.stops["x"].is_set()
    players.end("x")
    roster.follow(["x"])
    begun(players, "x", "x")
    assert not players.stops["x"].is_set()
    players.end_all()


def test_one_too_many_is_told_once_and_waits_for_a_seat(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    players = Players()
    roster = Roster(["a"], 3, players)
    for _ in range(5):
        roster.follow(["x", "y", "z"])
    assert roster.rigs == ["a", "x", "y"]
    told = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    assert told == [
        "rig z came and is not played: this server plays 3 rigs already, its most (--most-rigs); another sound server"
        " can play it"
    ]
    begun(players, "a", "x", "y")
    roster.follow(["y", "z"])
    assert roster.rigs == ["a", "x", "y"]  # x still fades
    players.end("x")
    roster.follow(["y", "z"])
    assert roster.rigs == ["a", "y", "z"]
    begun(players, "a", "x", "y", "z")
    assert "rig z came: 3 of at most 3 drums" in caplog.messages
    players.end_all()


def test_a_thread_that_ends_by_itself_is_a_fault() -> None:
    players = Players()
    roster = Roster(["a"], 8, players)
    begun(players, "a")
    assert not roster.is_broken
    players.end("a")
    assert roster.is_broken


@pytest.fixture
def clock() -> Callable[[float], Presences]:
    now = [100.0]
    presences = Presences(lambda: now[0])

    def after(seconds: float) -> Presences:
        now[0] += seconds
        return presences

    return after


def token(rig: str, service: str = "haptic", instance: str = "1") -> str:
    return Keys(rig).alive(service, instance)


def test_a_rig_that_goes_is_let_go_after_a_while_and_not_when_it_is_back(
    clock: Callable[[float], Presences],
) -> None:
    seen = clock(0.0)
    seen.note(token("a"), True)
    seen.note(token("b"), True)
    seen.note(token("c", "sound"), True)
    seen.note("drumstick/../alive/haptic/1", True)
    assert seen.rigs() == ["a", "b"]
    seen.note(token("a"), False)
    assert clock(LET_GO_S - 0.1).rigs() == ["a", "b"]
    seen.note(token("a", instance="2"), True)  # its servo or its gateway started anew
    assert clock(2.0 * LET_GO_S).rigs() == ["a", "b"]
    seen.note(token("a", instance="2"), False)
    clock(0.5 * LET_GO_S).note(token("a", instance="2"), False)  # told twice, by two patterns
    assert clock(0.5 * LET_GO_S).rigs() == ["b"]
    seen.note(token("a", instance="3"), True)
    assert seen.rigs() == ["b", "a"]


def test_a_server_that_follows_another_keeps_the_rig(clock: Callable[[float], Presences]) -> None:
    seen = clock(0.0)
    seen.note(token("a", instance="1"), True)
    seen.note(token("a", instance="2"), True)
    seen.note(token("a", instance="1"), False)
    assert clock(2.0 * LET_GO_S).rigs() == ["a"]


def test_made_up_rigs_fill_no_memory(clock: Callable[[float], Presences]) -> None:
    seen = clock(0.0)
    for number in range(5000):
        seen.note(token(f"r{number}"), True)
    assert len(seen.rigs()) == 1000
    for number in range(5000):
        seen.note(token(f"r{number}"), False)
    assert clock(LET_GO_S).rigs() == []
