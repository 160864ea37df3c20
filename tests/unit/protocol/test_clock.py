"""The other machine's clock by round trips: what is claimed is true, whatever the network does."""

import random
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.clock import ClockMap, HapticClock, RoundTrip, asked_clock
from protocol.messages import Clock, encode

S = 1_000_000_000


def _clock(*trips: RoundTrip) -> HapticClock | None:
    known = ClockMap()
    known.add(trips)
    return known.clock()


def test_the_shortest_round_trip_bounds_it() -> None:
    clock = _clock(RoundTrip(0, 100, 7, 1049), RoundTrip(200, 210, 7, 1205), RoundTrip(300, 400, 7, 1349))
    assert clock is not None
    assert clock.offset_ns == 1000
    assert 5 <= clock.error_ns <= 8
    assert clock.ours(1500) == 500
    assert clock.haptic(500) == 1500


def test_a_restart_in_between_counts_only_what_came_after() -> None:
    clock = _clock(RoundTrip(0, 2, 7, 5001), RoundTrip(10, 30, 8, 120))
    assert clock is not None
    assert (clock.boot, clock.offset_ns) == (8, 100)


def _trip(at_ns: int, offset_ns: int, error_ns: int, boot: int = 7) -> RoundTrip:
    return RoundTrip(at_ns - error_ns, at_ns + error_ns, boot, at_ns + offset_ns)


def test_a_restart_on_another_machine_is_no_drift() -> None:
    # The other clock is 0.1 ms ahead: a drift of 100 millionths would explain that, too.
    clock = _clock(_trip(0, 0, 1000), _trip(S, 100_000, 1000, boot=8))
    assert clock is not None
    assert (clock.offset_ns, clock.drift) == (100_000, 0.0)
    assert 1000 <= clock.error_ns <= 1003


def test_two_poor_comparisons_make_no_drift() -> None:
    clock = _clock(_trip(0, 0, 10_000_000), _trip(S, 200_000, 10_000_000))
    assert clock is not None
    assert clock.drift == 0.0


def test_a_drift_that_wanders_does_not_throw_away_what_is_known() -> None:
    known = ClockMap()
    for at_s in range(0, 111, 10):  # 2 millionths fast for a minute, then 2 slow
        gained_ns = 2000 * at_s if at_s <= 60 else 2000 * (120 - at_s)
        known.add([_trip(at_s * S, gained_ns, 500)])
        clock = known.clock()
        assert clock is not None
        assert abs(clock.offset_ns - gained_ns) <= clock.error_ns
    assert known.pause_s == 10.0


def test_weeks_of_comparing_fill_no_memory() -> None:
    known = ClockMap()
    for at_s in range(0, 20_000, 10):
        known.add([_trip(at_s * S, 0, 500)] * 5)
    assert len(vars(known)["_trips"]) <= 65


def test_without_answers_there_is_no_clock() -> None:
    assert _clock() is None


def test_there_and_back() -> None:
    clock = HapticClock(7, 10**15, 0, drift=123e-6, at_ns=10**12)
    for ours in (0, 10**12, 5 * 10**12):
        assert abs(clock.ours(clock.haptic(ours)) - ours) <= 1


class Machines:
    """Two clocks, `drift` apart, and a network whose two ways take what `delay` says, ns; in virtual time."""

    def __init__(self, drift: float, offset_ns: int, seed: int, least_ns: int, jitter_ns: int) -> None:
        self._chance = random.Random(seed)
        self._drift, self._offset_ns = drift, offset_ns
        self._least_ns, self._jitter_ns = least_ns, jitter_ns

    def haptic(self, our_ns: int) -> int:
        return our_ns + self._offset_ns + round(self._drift * our_ns)

    def delay(self) -> int:
        return self._least_ns + round(self._chance.expovariate(1.0 / self._jitter_ns))

    def trips(self, begun_ns: int, count: int = 5) -> list[RoundTrip]:
        found, now = [], begun_ns
        for _ in range(count):
            there = now + self.delay()
            back = there + self.delay()
            found.append(RoundTrip(now, back, 7, self.haptic(there)))
            now = back
        return found


def test_one_machines_clock_has_no_drift_however_long_the_trips() -> None:
    machines = Machines(0.0, 0, 1, 300_000, 3_000_000)
    known = ClockMap()
    at_ns = S
    for _ in range(12):
        known.add(machines.trips(at_ns))
        clock = known.clock()
        assert clock is not None
        assert clock.ours(at_ns + 10 * S) == at_ns + 10 * S
        at_ns += round(known.pause_s * S)


def test_a_machine_that_started_at_the_same_time_is_told_by_a_short_trip() -> None:
    assert (clock := _clock(_trip(0, 400_000, 1_000_000))) is not None
    assert (clock.offset_ns, clock.error_ns >= 400_000) == (0, True)
    assert (clock := _clock(_trip(0, 400_000, 1_000_000), _trip(S, 400_000, 1000))) is not None
    assert abs(clock.offset_ns - 400_000) <= clock.error_ns <= 2000


@given(
    drift=st.floats(-200e-6, 200e-6),
    offset_ns=st.integers(-(10**15), 10**15),
    seed=st.integers(0, 2**32),
    least_us=st.integers(20, 20_000),
    jitter_us=st.integers(1, 200_000),
    bursts=st.integers(1, 20),
)
def test_the_error_is_never_more_than_is_said(
    drift: float, offset_ns: int, seed: int, least_us: int, jitter_us: int, bursts: int
) -> None:
    machines = Machines(drift, offset_ns, seed, least_us * 1000, jitter_us * 1000)
    known = ClockMap()
    for i in range(bursts):
        known.add(machines.trips(1 + i * 10 * S))
        clock = known.clock()
        assert clock is not None
        for ahead_ns in (0, S // 10):
            at = clock.at_ns + ahead_ns
            wrong = abs(clock.haptic(at) - machines.haptic(at))
            # Until drift is known it may be anything that quartz allows.
            assert wrong <= clock.error_ns + 2 + 500e-6 * ahead_ns


def test_drift_of_a_hundred_millionths_is_found_and_taken_out() -> None:
    machines = Machines(100e-6, 10**12, 1, 50_000, 100_000)
    known = ClockMap()
    for i in range(12):
        known.add(machines.trips(1 + i * 10 * S))
    clock = known.clock()
    assert clock is not None
    assert clock.drift == pytest.approx(100e-6, abs=2e-6)
    ahead = clock.at_ns + 10 * S  # until the next burst: 1 ms if drift were left in
    assert abs(clock.haptic(ahead) - machines.haptic(ahead)) < 50_000


def test_many_trips_over_a_shaky_network_are_better_than_the_best_one() -> None:
    one_ns = many_ns = 0
    for seed in range(20):
        machines = Machines(0.0, 10**12, seed, 2_000_000, 50_000_000)
        known = ClockMap()
        known.add(machines.trips(1))
        one = known.clock()
        for i in range(1, 12):
            known.add(machines.trips(1 + i * 10 * S))
        many = known.clock()
        assert one is not None
        assert many is not None
        one_ns += one.error_ns
        many_ns += many.error_ns
    assert many_ns < one_ns / 2


@pytest.mark.parametrize("jump_ns", [-(10**10), 10**9, 3_600 * S])
def test_a_machine_that_was_suspended_is_found_out(jump_ns: int) -> None:
    machines = Machines(20e-6, 10**12, 5, 50_000, 50_000)
    known = ClockMap()
    for i in range(5):
        known.add(machines.trips(1 + i * 10 * S))
    moved = Machines(20e-6, 10**12 + jump_ns, 6, 50_000, 50_000)
    known.add(moved.trips(60 * S, count=1))
    clock = known.clock()
    assert clock is not None
    assert abs(clock.haptic(clock.at_ns) - moved.haptic(clock.at_ns)) <= clock.error_ns


def test_five_round_trips_are_asked_for_and_one_of_them_counts() -> None:
    asked: list[int] = []

    def ask() -> bytes:
        asked.append(1)
        return encode(Clock(boot=9, t_ns=time.monotonic_ns() + 10**12))

    clock = asked_clock(ClockMap(), ask, [].append)
    assert clock is not None
    assert (clock.boot, len(asked)) == (9, 5)
    assert abs(clock.offset_ns - 10**12) <= clock.error_ns


def test_what_was_known_counts_only_while_somebody_answers() -> None:
    known = ClockMap()
    assert asked_clock(known, lambda: encode(Clock(boot=9, t_ns=5)), lambda _: None) is not None
    assert asked_clock(known, lambda: None, lambda _: None) is None


def test_nonsense_is_told_and_what_came_before_it_counts() -> None:
    answers = [encode(Clock(boot=9, t_ns=5)), b"\xff", encode(Clock(boot=9, t_ns=6))]
    said: list[str] = []
    clock = asked_clock(ClockMap(), lambda: answers.pop(0), said.append)
    assert clock is not None
    assert clock.boot == 9
    assert len(said) == 1
    assert "clock ignored" in said[0]
    assert asked_clock(ClockMap(), lambda: None, said.append) is None
