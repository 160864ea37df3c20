"""A servo that has run for a month, a year or an age: it plays as on its first day, counts on, and needs no more room.

A month of ticks at 1 kHz takes two hours of a processor: drumstick lab month runs them, all 2.592e9 of them. Here the
clocks and counters begin where they would stand shortly before something could wrap or grow coarse, and ten million
ticks are run across these places.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from pythonosc.osc_message_builder import OscMessageBuilder

import live_sets
import sampled_arm
from drumstick_lab.soak.in_process import ticks
from haptic_server import block as blocks
from haptic_server.block_header import HEARTBEAT, PANIC, PANICS_SEEN
from haptic_server.records import EVENT, NO_FAULT, PLAYING, STRIKE, set_type
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from protocol import osc
from realtime import ring, triple_buffer
from realtime.atomics import add_to, peek
from realtime.kernels.jit import allocations
from stability.catalogue import shows

PERIOD_NS = sampled_arm.PERIOD_NS
SECOND_NS, DAY_NS = 10**9, 86_400 * 10**9
MINUTE = 60_000  # ticks
# Strikes may be this far from the reference's cycle over the whole run.
MAX_OFF_NS = 2.0  # one that is written in whole ns, and one to spare
CLOCKS_NS = {
    "30 days": 30 * DAY_NS,
    "a year": 365 * DAY_NS,
    "2^31 ns": 2**31,
    "2^32 ns": 2**32,
    "2^53 ns": 2**53,
    "2^31 ms": 2**31 * 10**6,
    "2^62 ns": 2**62,
}
COUNTS = {"2^31": 2**31, "2^32": 2**32, "2^53": 2**53, "2^62": 2**62}


def _advanced(servo: memory.Servo, count: int) -> None:
    """All that counts stands `count` ahead, as if it had been counted there."""
    servo.status["tick"] += count
    for name in ("seq", "traced", "revision", "refused", "panics_seen"):
        servo.tick_state[name] += count
    for cell in (ring.WRITTEN, ring.READ, ring.DROPPED):
        servo.block.ring_cells[cell] += count
    servo.block.control[[PANIC, PANICS_SEEN]] += count
    servo.block.lateness[0] += count


def _events(servo: memory.Servo) -> npt.NDArray[np.void]:
    out = np.zeros(blocks.RING_SLOTS, EVENT)
    return out[: ring.drain(servo.block.ring_cells, servo.block.events, out)].copy()


def _since(events: npt.NDArray[np.void], start_ns: int, seq: int) -> npt.NDArray[np.void]:
    events["t_ns"] -= start_ns
    events["seq"] -= seq
    return events


@pytest.fixture(scope="module")
def first_day() -> npt.NDArray[np.void]:
    """The default scene's events in the first two minutes of a clock that begins at one second."""
    servo = live_sets.servo_of(live_sets.roll())
    loop.run_virtual(servo, 2 * MINUTE, SECOND_NS)
    return _since(_events(servo), SECOND_NS, 0)


@shows("month of ticks", "ours")
@pytest.mark.long
@pytest.mark.parametrize("clock", CLOCKS_NS)
def test_a_late_clock_plays_the_very_same(clock: str, first_day: npt.NDArray[np.void]) -> None:
    """To the nanosecond and to the last bit: the stick does not know how late it is. The middle of it is the limit."""
    start_ns = CLOCKS_NS[clock] // PERIOD_NS * PERIOD_NS - MINUTE * PERIOD_NS
    servo = live_sets.servo_of(live_sets.roll())
    end_ns = loop.run_virtual(servo, 2 * MINUTE, start_ns)
    assert end_ns == start_ns + 2 * MINUTE * PERIOD_NS
    assert servo.status["t_ns"][0] == peek(servo.block.control, HEARTBEAT) == end_ns
    assert servo.status["status"][0] == PLAYING
    assert _since(_events(servo), start_ns, 0).tobytes() == first_day.tobytes()


@shows("month of ticks", "ours")
@pytest.mark.long
@pytest.mark.parametrize("count", COUNTS)
def test_counters_go_on_beyond(count: str, first_day: npt.NDArray[np.void]) -> None:
    servo = live_sets.servo_of(live_sets.roll())
    half = len(first_day) // 2
    ahead = COUNTS[count] - half // 2  # strikes pass it in the middle, and so does what the ring has written
    _advanced(servo, ahead)
    loop.run_virtual(servo, 2 * MINUTE, SECOND_NS)
    assert peek(servo.block.ring_cells, ring.WRITTEN) == ahead + len(first_day)
    assert peek(servo.block.ring_cells, ring.DROPPED) == ahead
    assert servo.status["tick"][0] == ahead + 2 * MINUTE
    assert servo.status["strikes"][0] == ahead + np.count_nonzero(first_day["kind"] == STRIKE)
    assert _since(_events(servo), SECOND_NS, ahead).tobytes() == first_day.tobytes()
    assert servo.tick_state["traced"][0] == ahead + 2 * MINUTE
    assert servo.status["status"][0] == PLAYING
    _sets_and_panics_still_work(servo, ahead)


def _sets_and_panics_still_work(servo: memory.Servo, ahead: int) -> None:
    now = SECOND_NS + 2 * MINUTE * PERIOD_NS
    live_sets.offer(servo, ahead + 1, live_sets.changed(servo.law, live_sets.roll(), {"dv_pls": 0.3}))
    now = loop.run_virtual(servo, 100, now)
    assert (servo.law["pulse"]["dv_pls"][0], servo.tick_state["revision"][0]) == (0.3, ahead + 1)
    told = np.zeros(1, set_type(servo.law.dtype))
    assert triple_buffer.read_into(servo.block.live_cells, servo.block.live, told)
    assert told["revision"][0] == ahead + 1
    add_to(servo.block.control, PANIC, 1)
    loop.run_virtual(servo, 1, now)
    assert servo.tick_state["panicked"][0] == 1
    assert peek(servo.block.control, PANICS_SEEN) == ahead + 1


@pytest.mark.long
def test_a_ring_that_was_dropped_from_for_ages_wraps_at_its_own_length() -> None:
    """Its slots are found by the remainder: nothing in it depends on how much went through before."""
    for count in COUNTS.values():
        servo = live_sets.servo_of(live_sets.roll())
        _advanced(servo, count - 5)
        loop.run_virtual(servo, 400_000, SECOND_NS)  # more than it holds
        kept = _events(servo)
        assert len(kept) == blocks.RING_SLOTS
        assert np.array_equal(np.unique(kept["seq"]), np.arange(count - 4, count - 4 + len(kept) // 2))
        dropped = peek(servo.block.ring_cells, ring.DROPPED) - (count - 5)
        struck = servo.tick_state["seq"][0] - (count - 5)
        assert dropped + len(kept) == 2 * struck - (servo.motion["contact_phase"][0] != 0)


@shows("counter beyond 31 bits")
def test_what_goes_out_by_osc_starts_again_at_zero_after_31_bits() -> None:
    """python-osc would send 64 bits, which neither Pd nor SuperCollider reads."""
    usual = osc.strike("/d", 1, 0.0, 0.0, 1.0, 0.5, 9.0)
    for seq in COUNTS.values():
        assert len(osc.strike("/d", seq + 3, 0.0, 0.0, 1.0, 0.5, 9.0)) == len(usual)
        naive = OscMessageBuilder("/d/strike")
        naive.add_arg(seq + 3)
        assert b",h" in naive.build().dgram
    wrapped = osc.strike("/d", 2**31 + 3, 0.0, 0.0, 1.0, 0.5, 9.0)
    assert wrapped == osc.strike("/d", 3, 0.0, 0.0, 1.0, 0.5, 9.0)


def _resident_pages() -> int:
    with open("/proc/self/statm", encoding="ascii") as words:
        return int(words.read().split()[1])


@shows("month of ticks", "ours")
@pytest.mark.long
def test_an_hour_and_a_half_across_every_limit_keeps_the_rate_and_the_memory() -> None:
    """Five million ticks: the clock passes 2^53 ns, the ticks 2^31, the strikes 2^32. Every strike is on the cycle."""
    servo, minutes = live_sets.servo_of(live_sets.roll()), 84
    servo.status["tick"] = 2**31 - minutes // 2 * MINUTE
    servo.tick_state["seq"] = seq = 2**32 - minutes // 2 * 1383
    now = 2**53 // PERIOD_NS * PERIOD_NS - minutes // 2 * MINUTE * PERIOD_NS
    # Settled after a minute: the slowest that dies away shrinks to 0.6 a strike.
    comb = ticks.Comb(ticks.ROLL_HZ)
    off, allocated, pages = 0.0, set[int](), list[int]()
    out, newest = ticks.room(), seq
    for _ in range(minutes):
        before = allocations()
        now = ticks.run(servo, MINUTE, now)
        allocated.add(allocations() - before)
        strikes = ticks.strikes_of(ticks.taken(servo, out), newest)
        newest += len(strikes)
        off = max(off, float(np.max(np.abs(comb.residuals_ns(strikes["seq"], strikes["t_ns"])))))
        pages.append(_resident_pages())
    assert comb.origin is not None
    assert comb.origin[0] < seq + 1400, "settled within the first minute"
    assert off <= MAX_OFF_NS
    assert servo.tick_state["seq"][0] > 2**32 > seq
    assert servo.status["tick"][0] == 2**31 + minutes // 2 * MINUTE
    assert peek(servo.block.ring_cells, ring.DROPPED) == 0
    assert len(allocated) == 1, "what the call from Python costs, and nothing besides"
    assert max(pages[-20:]) <= max(pages[:20]) + 256, "a megabyte is what the interpreter itself may breathe"


def _strokes(late: bool, start_ns: int) -> tuple[npt.NDArray[np.void], Any]:
    played = sampled_arm.scene("strokes", "friction_N = 0.3")
    servo = sampled_arm.servo_of(played)
    if late:
        _advanced(servo, 2**31 - 500)
    loop.run_virtual(servo, 2 * MINUTE, start_ns)
    return _since(_events(servo), start_ns, 2**31 - 500 if late else 0), servo.tick_state[0]


@shows("month of ticks", "ours")
@pytest.mark.long
@pytest.mark.parametrize("clock", ["30 days", "a year", "2^53 ns"])
def test_an_arm_strikes_in_time_however_late_it_is(clock: str) -> None:
    """Its speed comes from positions over time, which a late clock rounds to 4 ns: the strokes stay where they are."""
    early, _ = _strokes(late=False, start_ns=SECOND_NS)
    late, tick_state = _strokes(
        late=True, start_ns=CLOCKS_NS[clock] // PERIOD_NS * PERIOD_NS - MINUTE * PERIOD_NS
    )
    assert tick_state["fault"] == NO_FAULT
    firsts = [_first_of_each_stroke(events) for events in (early, late)]
    strokes = len(firsts[0])
    assert strokes == len(firsts[1]) >= 239  # one may begin before the first tick, or end after the last
    # Within a stroke the bounces are the arm's own; each stroke begins when the hand says.
    assert np.max(np.abs(firsts[0] - firsts[1])) <= 5 * PERIOD_NS
    # The first one comes from where the arm began, so it may be some milliseconds early.
    assert np.polyfit(np.arange(1, strokes), firsts[1][1:], 1)[0] == pytest.approx(0.5e9, rel=1e-6)


def _first_of_each_stroke(events: npt.NDArray[np.void]) -> npt.NDArray[np.int64]:
    strikes = events[events["kind"] == STRIKE]["t_ns"]
    stroke = (strikes - strikes[0] + 100 * PERIOD_NS) // 500_000_000
    return strikes[np.unique(stroke, return_index=True)[1]]


@pytest.mark.long
def test_a_hand_that_has_played_for_a_month_keeps_time() -> None:
    """Its gesture's clock starts again each period: no sum grows, and none is rounded more coarsely from day to day."""
    servo = sampled_arm.servo_of(sampled_arm.scene("strokes"))
    loop.run_virtual(servo, 2 * MINUTE, 0)
    assert 0.3 <= servo.plant["t_s"][0] < 0.3 + 0.5 + 1e-9
    assert servo.plant["t_s"][0] == pytest.approx(0.3 + (120.0 - 0.3) % 0.5, abs=1e-9)
