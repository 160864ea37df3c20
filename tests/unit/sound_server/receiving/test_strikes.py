import logging
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.drum.memory.strikes import EVENT, RING_SLOTS, StrikeRing
from drumstick.scenes.scene_text import parse
from protocol.clock import HapticClock
from protocol.messages import Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from realtime.ring import drain
from sound_server.receiving.strikes import Deduplicator, StrikeScheduler
from stability.catalogue import shows

MS = 1_000_000
NOW = 5_000_000_000
OFFSET = 123_456_789_000  # haptic minus ours


def message(
    seq: int, t_ns: int = NOW + OFFSET, boot: int = 7, source: str = "stick", **changes: float
) -> bytes:
    contact = {"peak_estimate_N": 5.0, "contact_estimate_s": 0.005}
    values: dict[str, Any] = {"x": 0.1, "y": 0.2, "z_speed_m_per_s": 0.6, "level": 0.3} | contact | changes
    strike = Strike(boot=boot, seq=seq, t_ns=t_ns, source=source, **values)
    return encode(strike)


class Bench:
    """A scheduler, its ring, and the boots it heard."""

    def __init__(self, latency_s: float = 0.0) -> None:
        self.ring = StrikeRing()
        self.boots: list[int] = []
        self.scheduler = StrikeScheduler(self.ring, RateLimitedLog(lambda: 0), self.boots.append)
        self.scheduler.clock = HapticClock(7, OFFSET, 0)
        self.scheduler.latency_s = latency_s

    def onsets(self) -> list[int]:
        out = np.zeros(RING_SLOTS, EVENT)
        return [int(event["onset_ns"]) for event in out[: drain(self.ring.cells, self.ring.slots, out)]]


@shows("strikes late, lost and doubled", "ours")
def test_a_strike_is_played_once_however_often_it_comes() -> None:
    bench = Bench()
    for seq in (1, 2, 2, 1, 3):
        bench.scheduler.take(message(seq), NOW)
    bench.scheduler.take(message(1, boot=8), NOW)  # a servo that started anew counts from the beginning
    assert len(bench.onsets()) == bench.scheduler.played == 4
    assert bench.scheduler.duplicates == 2
    assert bench.boots == [7, 7, 7, 7, 7, 8]


def test_a_played_strike_is_scheduled_like_the_sticks_and_is_no_new_start() -> None:
    bench = Bench(latency_s=0.02)
    for seq, boot, source in ((1, 7, "stick"), (1, 99, "osc a"), (1, 99, "osc a")):
        bench.scheduler.take(message(seq, NOW + OFFSET - 3 * MS, boot, source), NOW)
    assert bench.onsets() == [NOW + 17 * MS] * 2
    assert (bench.scheduler.played, bench.scheduler.duplicates) == (2, 1)
    assert bench.boots == [7]
    bench.scheduler.take(message(2, NOW + OFFSET - 100 * MS, 99, "osc a"), NOW)
    assert bench.scheduler.late == 1


def test_where_contacts_stream_a_played_strike_sounds_by_itself() -> None:
    bench = Bench()
    noted: list[Strike] = []
    bench.scheduler.note = noted.append
    bench.scheduler.take(message(1), NOW)
    bench.scheduler.take(message(1, boot=99, source="midi 38"), NOW)
    assert [strike.source for strike in noted] == ["stick"]
    assert bench.onsets() == [0]


def test_without_latency_a_strike_sounds_at_once() -> None:
    bench = Bench()
    bench.scheduler.take(message(1, NOW + OFFSET - 3 * MS), NOW)
    assert bench.onsets() == [0]


def test_with_latency_a_strike_sounds_at_its_instant_on_our_clock() -> None:
    bench = Bench(latency_s=0.02)
    bench.scheduler.take(message(1, NOW + OFFSET - 3 * MS), NOW)
    assert bench.onsets() == [NOW + 17 * MS]


@pytest.mark.parametrize("latency_s", [0.0, 0.02])
def test_more_than_fifty_milliseconds_late_is_too_late(latency_s: float) -> None:
    bench = Bench(latency_s)
    due = NOW + OFFSET - round(latency_s * 1e9)
    bench.scheduler.take(message(1, due - 49 * MS), NOW)
    bench.scheduler.take(message(2, due - 51 * MS), NOW)
    assert (bench.scheduler.played, bench.scheduler.late) == (1, 1)
    assert len(bench.onsets()) == 1


def test_a_clock_of_another_boot_says_nothing_about_age() -> None:
    bench = Bench(latency_s=0.02)
    bench.scheduler.take(message(1, 12, boot=8), NOW)
    assert bench.onsets() == [0]


def test_a_strike_from_the_far_future_does_not_wait_for_it() -> None:
    bench = Bench(latency_s=0.02)
    bench.scheduler.take(message(1, NOW + OFFSET + 3_600_000 * MS), NOW)
    bench.scheduler.take(message(2, 2**63), NOW)
    assert bench.onsets() == [0, 0]


def test_a_full_ring_drops_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    bench = Bench()
    for seq in range(RING_SLOTS + 3):
        bench.scheduler.take(message(seq), NOW)
    assert bench.scheduler.played == RING_SLOTS
    assert len(caplog.records) == 1  # the log's clock stands still
    assert "256 are waiting" in caplog.text


@shows("force that is no number", "ours")
@pytest.mark.parametrize(
    "change",
    [
        {"peak_estimate_N": 1e5},
        {"peak_estimate_N": -1.0},
        {"contact_estimate_s": 2.0},
        {"impulse_N_s": 1e5},
        {"contact_estimate_s": -0.001},
        {"x": 1e300},
        {"y": float("nan")},
        {"peak_estimate_N": float("inf")},
    ],
)
def test_what_no_stick_can_do_is_refused(change: dict[str, float]) -> None:
    bench = Bench()
    bench.scheduler.take(message(1, **change), NOW)
    assert (bench.scheduler.refused, bench.scheduler.played, bench.onsets()) == (1, 0, [])


@given(st.binary(max_size=200))
def test_no_bytes_stop_the_desk(payload: bytes) -> None:
    logging.disable()
    try:
        bench = Bench()
        bench.scheduler.take(payload, NOW)
        bench.scheduler.take(message(1), NOW)
    finally:
        logging.disable(logging.NOTSET)
    assert len(bench.onsets()) >= 1


@given(st.lists(st.one_of(st.integers(-(2**63), 2**64 - 1), st.floats(), st.none(), st.text()), max_size=12))
def test_no_array_stops_the_desk(items: list[object]) -> None:
    logging.disable()
    try:
        bench = Bench(latency_s=0.1)
        bench.scheduler.take(msgspec.msgpack.encode([1, *items]), NOW)
        bench.scheduler.take(message(1, boot=-7), NOW)
    finally:
        logging.disable(logging.NOTSET)
    assert len(bench.onsets()) >= 1


def test_the_memory_of_strikes_is_bounded() -> None:
    once = Deduplicator(remembered=3)
    assert [once.is_new(1, seq) for seq in (1, 2, 3, 4, 4, 2, 1)] == [
        True,
        True,
        True,
        True,
        False,
        False,
        True,
    ]


def test_complaints_come_at_most_once_a_second(caplog: pytest.LogCaptureFixture) -> None:
    instants = [0, 1, 999_999_999, 1_000_000_000, 1_000_000_001]
    limited_log = RateLimitedLog(iter(instants).__next__)
    for _ in instants:
        limited_log.warn("bad")
    assert [record.getMessage() for record in caplog.records] == ["bad", "bad (and 2 more)"]


@pytest.mark.parametrize("is_streamed", [False, True])
def test_how_long_strikes_took_to_come_is_told_whatever_they_sound_by(is_streamed: bool) -> None:
    bench = Bench()
    noted: list[Strike] = []
    bench.scheduler.note = noted.append if is_streamed else None
    for seq, took_ms in enumerate((2, 3, 4)):
        bench.scheduler.take(message(seq, NOW + OFFSET - took_ms * MS), NOW)
    told = bench.scheduler.arrivals.summary()
    assert told.arrival_ms == pytest.approx(3.0)
    assert told.jitter_ms == pytest.approx(1.8)
    assert told.unpunctual == 0
    assert len(noted) == (3 if is_streamed else 0)


def test_a_strike_that_comes_after_its_instant_is_unpunctual_though_it_sounds() -> None:
    bench = Bench(latency_s=0.02)
    for seq, took_ms in enumerate((19, 21)):
        bench.scheduler.take(message(seq, NOW + OFFSET - took_ms * MS), NOW)
    assert bench.scheduler.arrivals.summary().unpunctual == 1
    assert bench.scheduler.played == 2


MALLET = '[drum]\nexcitation = "mallet"\n'


def test_only_a_mallet_asks_how_fast_the_strike_was() -> None:
    bench = Bench()
    bench.scheduler.take(message(1, z_speed_m_per_s=1001.0), NOW)
    bench.scheduler.scene = parse("", "no mallet")
    bench.scheduler.take(message(2, z_speed_m_per_s=1001.0), NOW)
    assert (bench.scheduler.played, bench.scheduler.refused) == (2, 0)
    bench.scheduler.scene = parse(MALLET, "mallet")
    bench.scheduler.take(message(3, z_speed_m_per_s=1001.0), NOW)
    bench.scheduler.take(message(4, z_speed_m_per_s=999.0), NOW)
    assert (bench.scheduler.played, bench.scheduler.refused) == (3, 1)


@pytest.mark.parametrize(
    ("strike", "level", "speed"),
    [("", 0.25, 0.6), ("stroke_m_per_s = 9.0\nsoft_stroke_m_per_s = 1.0", 0.25, 3.0)],
)
def test_a_mallets_stroke_is_what_the_level_stands_for(strike: str, level: float, speed: float) -> None:
    bench = Bench()
    bench.scheduler.scene = parse(f"{MALLET}[strike]\n{strike}\n", "mallet")
    bench.scheduler.take(message(1, level=level), NOW)
    out = np.zeros(RING_SLOTS, EVENT)
    events = out[: drain(bench.ring.cells, bench.ring.slots, out)]
    assert events["speed_m_per_s"].tolist() == [speed]
