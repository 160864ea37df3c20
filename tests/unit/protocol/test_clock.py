import time

from protocol.clock import RoundTrip, asked_clock, clock_from
from protocol.messages import Clock, encode


def test_the_shortest_round_trip_counts() -> None:
    clock = clock_from(
        [RoundTrip(0, 100, 7, 1049), RoundTrip(200, 210, 7, 1205), RoundTrip(300, 400, 7, 1399)]
    )
    assert clock is not None
    assert (clock.offset_ns, clock.error_ns) == (1000, 5)
    assert clock.ours(1500) == 500
    assert clock.haptic(500) == 1500


def test_a_restart_in_between_counts_only_what_came_after() -> None:
    clock = clock_from([RoundTrip(0, 2, 7, 5001), RoundTrip(10, 30, 8, 120)])
    assert clock is not None
    assert (clock.boot, clock.offset_ns) == (8, 100)


def test_without_answers_there_is_no_clock() -> None:
    assert clock_from([]) is None


def test_five_round_trips_are_asked_for_and_one_of_them_counts() -> None:
    asked: list[int] = []

    def ask() -> bytes:
        asked.append(1)
        return encode(Clock(boot=9, t_ns=time.monotonic_ns() + 10**12))

    clock = asked_clock(ask, [].append)
    assert clock is not None
    assert (clock.boot, len(asked)) == (9, 5)
    assert abs(clock.offset_ns - 10**12) <= clock.error_ns


def test_nonsense_is_told_and_what_came_before_it_counts() -> None:
    answers = [encode(Clock(boot=9, t_ns=5)), b"\xff", encode(Clock(boot=9, t_ns=6))]
    said: list[str] = []
    clock = asked_clock(lambda: answers.pop(0), said.append)
    assert clock is not None
    assert clock.boot == 9
    assert len(said) == 1
    assert "clock ignored" in said[0]
    assert asked_clock(lambda: None, said.append) is None
