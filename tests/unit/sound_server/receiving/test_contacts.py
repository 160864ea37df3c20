"""Contact messages as a network delivers them: lost, twice, out of order, late, of another servo, or nonsense."""

import logging

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.drum.build import new_engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.memory.timeline import PIECE, RING_SLOTS, stream_of
from protocol.clock import HapticClock
from protocol.messages import Contact, Strike, encode
from protocol.rate_limited_log import RateLimitedLog
from realtime.ring import drain
from sound_server.receiving.contacts import ContactScheduler
from sound_server.receiving.strikes import StrikeScheduler
from stability.catalogue import shows
from streamed_engine import MS, streamed

NOW = 5_000_000_000
OFFSET = 123_456_789_000  # haptic minus ours


def message(
    first: int, forces: list[float] | bytes, boot: int = 7, seq: int = 1, tell: bool = True, **changes
) -> bytes:
    """A piece whose tick 0 began at NOW."""
    packed = forces if isinstance(forces, bytes) else np.asarray(forces, "<f4").tobytes()
    values = {"rate_Hz": 1000.0, "forces": packed}
    if tell:
        values |= {"t_ns": NOW + OFFSET + first * MS, "x": 0.1, "y": 0.2}
    return encode(Contact(boot=boot, seq=seq, first_tick=first, **(values | changes)))


class Bench:
    """A scheduler, its stream's ring, and the boots it heard."""

    def __init__(self, latency_s: float = 0.02) -> None:
        self.boots: list[int] = []
        self.scheduler = ContactScheduler(RateLimitedLog(lambda: 0), self.boots.append)
        self.scheduler.clock = HapticClock(7, OFFSET, 0)
        self.stream = stream_of(streamed(latency_s), 1.0 / 16000.0)
        self.scheduler.play_on(self.stream, latency_s)

    def pieces(self) -> np.ndarray:
        out = np.zeros(RING_SLOTS, PIECE)
        return out[: drain(self.stream.ring_cells, self.stream.ring_slots, out)]

    def ticks(self) -> dict[int, float]:
        """Forces that reached the audio thread: the force of each tick, and that no tick came twice."""
        found: dict[int, float] = {}
        for piece in self.pieces():
            for k in range(piece["count"]):
                assert int(piece["first"]) + k not in found
                found[int(piece["first"]) + k] = float(piece["forces"][k])
        return found


def test_a_piece_sounds_its_latency_after_its_tick() -> None:
    bench = Bench(0.02)
    bench.scheduler.take(message(4, [1.0, 2.0]), NOW + 7 * MS)
    (piece,) = bench.pieces()
    assert piece["start_ns"] == NOW + 4 * MS + 20 * MS
    assert (piece["first"], piece["count"], piece["x"], piece["y"]) == (4, 2, 0.1, 0.2)
    assert piece["forces"][:2].tolist() == [1.0, 2.0]
    assert (bench.scheduler.played, bench.boots) == (1, [7])


def test_without_a_latency_of_the_scenes_it_is_three_pieces_and_a_block() -> None:
    bench = Bench(0.0)
    bench.stream.state["block_ns"] = 2_666_667
    assert bench.scheduler.delay_s == pytest.approx(0.006 + 0.002666667)
    bench.scheduler.take(message(0, [1.0, 2.0]), NOW + 3 * MS)
    bench.scheduler.take(message(2, [1.0, 0.0]), NOW + 5 * MS)
    starts = bench.pieces()["start_ns"].tolist()
    assert starts == [NOW + 8_666_667, NOW + 10_666_667]


@shows("streamed force that jitters", "ours")
@given(st.randoms(use_true_random=False), st.lists(st.integers(1, 5), min_size=1, max_size=30))
def test_loss_repetition_and_order_change_nothing_but_what_was_lost(random, sizes: list[int]) -> None:
    sent: list[tuple[int, list[float]]] = []
    for size in sizes:
        first = sum(len(forces) for _, forces in sent)
        sent.append((first, [float(first + k + 1) for k in range(size)]))
    arriving = [piece for piece in sent if random.random() < 0.8]
    expected = {first + k: force for first, forces in arriving for k, force in enumerate(forces)}
    arriving += [piece for piece in arriving if random.random() < 0.3]
    random.shuffle(arriving)
    bench = Bench(0.2)
    for first, forces in arriving:
        bench.scheduler.take(message(first, forces), NOW)
    assert bench.scheduler.duplicates == len(arriving) - len({first for first, _ in arriving})
    assert bench.ticks() == expected


def test_what_overlaps_is_played_once() -> None:
    bench = Bench()
    bench.scheduler.take(message(2, [1.0, 2.0]), NOW)
    bench.scheduler.take(message(0, [9.0, 9.0, 9.0, 9.0, 9.0, 3.0]), NOW)
    assert bench.ticks() == {0: 9.0, 1: 9.0, 2: 1.0, 3: 2.0, 4: 9.0, 5: 3.0}
    assert bench.scheduler.duplicates == 0
    bench.scheduler.take(message(1, [7.0, 7.0]), NOW)
    assert bench.scheduler.duplicates == 1
    # Two contacts that share a tick are two: their forces add up.
    bench.scheduler.take(message(5, [4.0, 0.0], seq=2), NOW)
    assert bench.ticks() == {5: 4.0, 6: 0.0}
    assert bench.scheduler.played == 2


def test_a_beginning_that_comes_late_sounds_as_soon_as_it_can_and_far_too_late_not_at_all() -> None:
    bench = Bench(0.01)
    bench.stream.state["block_ns"] = 2_000_000
    now = NOW + 40 * MS
    bench.scheduler.take(message(0, [1.0]), now)
    bench.scheduler.take(message(0, [1.0], seq=2), NOW + 61 * MS)
    (piece,) = bench.pieces()
    assert piece["start_ns"] == now + 3 * MS  # a block, and a millisecond for the next piece
    assert bench.scheduler.late == 1


def test_a_servo_that_restarted_leaves_the_one_before_behind() -> None:
    bench = Bench()
    bench.scheduler.take(message(100, [1.0]), NOW)
    bench.scheduler.take(message(0, [2.0], boot=8), NOW)
    bench.scheduler.clock = HapticClock(8, OFFSET, 0)
    bench.scheduler.take(message(101, [3.0]), NOW)  # of the old one, held up on the way
    assert bench.pieces()["epoch"].tolist() == [7, 8]
    assert bench.scheduler.late == 1
    assert bench.boots == [7, 8, 7]


def test_a_stray_message_of_no_servo_mutes_nobody() -> None:
    bench = Bench()
    for first, boot in ((0, 7), (0, 1), (1, 7), (2, 7)):
        bench.scheduler.take(message(first, [1.0], boot=boot), NOW)
    assert bench.pieces()["epoch"].tolist() == [7, 1, 7, 7]


def test_without_a_clock_pieces_follow_each_other_from_the_first_ones_arrival() -> None:
    bench = Bench(0.02)
    bench.scheduler.clock = None
    arrivals = (0, 3, 3, 6)  # ms: jitter
    for k, at in enumerate(arrivals):
        bench.scheduler.take(message(2 * k, [1.0, 1.0]), NOW + at * MS)
    assert np.diff(bench.pieces()["start_ns"]).tolist() == [2 * MS] * 3
    bench.scheduler.take(message(5000, [1.0, 1.0]), NOW + 300 * MS)  # after a pause whose length nobody knows
    assert bench.pieces()["start_ns"].tolist() == [NOW + 320 * MS]


def test_a_clock_that_is_wrong_by_an_hour_is_not_waited_for() -> None:
    bench = Bench(0.02)
    bench.scheduler.take(message(0, [1.0], t_ns=NOW + OFFSET + 3_600_000 * MS), NOW)
    bench.scheduler.take(message(1, [1.0], t_ns=2**62), NOW)
    assert (bench.pieces()["start_ns"] <= NOW + 25 * MS).all()


def test_a_piece_of_the_six_elements_is_where_its_strike_was() -> None:
    bench = Bench()
    strikes = StrikeScheduler(StrikeRing(), RateLimitedLog(lambda: 0), bench.boots.append)
    strikes.note = bench.scheduler.note
    strike = Strike(
        boot=7, seq=3, t_ns=NOW + OFFSET, x=-0.4, y=0.3, z_speed_m_per_s=0.6, level=0.3, peak_estimate_N=5.0,
        contact_estimate_s=0.005,
    )  # fmt: skip
    strikes.take(encode(strike), NOW)
    six = msgspec.msgpack.encode([1, 7, 3, 40, 1000.0, np.float32([1.0, 2.0]).tobytes()])
    bench.scheduler.take(six, NOW)
    (piece,) = bench.pieces()
    assert (piece["x"], piece["y"]) == (-0.4, 0.3)
    assert strikes.played == 0


def test_a_strike_of_a_streamed_scene_starts_no_pulse() -> None:
    engine_ring = StrikeRing()
    engine = new_engine(streamed(), 48000, engine_ring)
    assert engine.stream is not None
    scheduler = StrikeScheduler(engine_ring, RateLimitedLog(lambda: 0), lambda _boot: None)
    scheduler.note = ContactScheduler(RateLimitedLog(lambda: 0), lambda _boot: None).note
    strike = Strike(
        boot=7, seq=3, t_ns=NOW, x=-0.4, y=0.3, z_speed_m_per_s=0.6, level=0.3, peak_estimate_N=5.0,
        contact_estimate_s=0.005,
    )  # fmt: skip
    scheduler.take(encode(strike), NOW)
    assert engine_ring.cells[0] == 0


@pytest.mark.parametrize(
    ("forces", "changes"),
    [
        ([1.0, float("nan")], {}),
        ([float("inf")], {}),
        ([-1.0, -float("inf"), 1.0], {}),
        ([1.0, 1.0001e4], {}),
        ([-2e4], {}),
        ([], {}),
        ([0.0] * 513, {}),
        (b"\0" * 7, {}),
        ([1.0], {"rate_Hz": 0.0}),
        ([1.0], {"rate_Hz": -1000.0}),
        ([1.0], {"rate_Hz": 1e9}),
        ([1.0], {"rate_Hz": float("nan")}),
        ([1.0], {"x": float("inf")}),
        ([1.0], {"y": 1e9}),
        ([1.0], {"t_ns": -5}),
        ([1.0], {"t_ns": 2**63}),
    ],
)
def test_what_no_stick_can_do_is_refused_whole_and_counted(
    forces: list[float] | bytes, changes: dict[str, object]
) -> None:
    bench = Bench()
    bench.scheduler.take(message(1, forces, **changes), NOW)
    assert (bench.scheduler.refused, bench.scheduler.played, bench.ticks()) == (1, 0, {})
    bench.scheduler.take(message(1, [1.0]), NOW)
    assert bench.ticks() == {1: 1.0}


@pytest.mark.parametrize(("first", "boot"), [(-1, 7), (2**60, 7), (0, -1), (0, 2**63)])
def test_numbers_that_no_servo_counts_to_are_refused(first: int, boot: int) -> None:
    bench = Bench()
    bench.scheduler.take(message(first, [1.0], boot=boot, t_ns=NOW), NOW)
    assert (bench.scheduler.refused, bench.ticks()) == (1, {})


@given(
    st.one_of(
        st.binary(max_size=200),
        st.lists(
            st.one_of(st.integers(-(2**63), 2**64 - 1), st.floats(), st.none(), st.binary(max_size=40)),
            max_size=12,
        ).map(lambda items: msgspec.msgpack.encode([1, *items])),
    )
)
def test_no_bytes_stop_the_desk(payload: bytes) -> None:
    logging.disable()
    try:
        bench = Bench()
        bench.scheduler.take(payload, NOW)
        bench.scheduler.take(message(2**40, [1.0], boot=2**50), NOW)
    finally:
        logging.disable(logging.NOTSET)
    assert bench.scheduler.played + bench.scheduler.late >= 1


def test_a_full_ring_drops_and_says_so(caplog: pytest.LogCaptureFixture) -> None:
    bench = Bench(0.5)
    for first in range(RING_SLOTS + 5):
        bench.scheduler.take(message(first, [1.0]), NOW)
    assert len(bench.pieces()) == RING_SLOTS
    assert "waiting for the audio" in caplog.text


def test_without_a_stream_nothing_is_kept() -> None:
    bench = Bench()
    bench.scheduler.play_on(None, 0.0)
    bench.scheduler.take(message(0, [1.0]), NOW)
    assert (bench.ticks(), bench.scheduler.underflows, bench.scheduler.played) == ({}, 0, 0)
