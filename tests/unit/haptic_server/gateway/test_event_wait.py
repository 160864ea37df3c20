"""The gateway's wait: no strike that a bounded pull can make comes unseen, a stick at rest is looked at seldom."""

import math
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from any_scene import eased, likely_scenes
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.safety.envelope import Limits
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import Records, law_of, thrown
from drumstick.stick.motion import exact
from haptic_server import block as blocks
from haptic_server.block import Block
from haptic_server.gateway import event_wait
from haptic_server.gateway.event_wait import AFTER_TICK_NS, MAX_SLEEP_NS, flight_ns, is_still, next_look_ns
from haptic_server.records import EVENT, STATUS
from realtime import ring, triple_buffer
from realtime.atomics import poke

MS = 1_000_000
PULL = event_wait.MAX_ACCELERATION_M_PER_S2
_FOR_EVER_NS = 10**18
_PASSED = 1e-9  # of the flight: what rounding to 64 bits may do


class Tick(NamedTuple):
    """Height, speed and event that the servo published at a tick."""

    z_m: float
    v_m_per_s: float
    has_struck: bool
    has_released: bool = False


def watched(
    ticks: Iterator[Tick], late_ns: Callable[[int], int] = lambda _tick: 10_000
) -> tuple[int, list[int]]:
    """Number of looks at ticks of 1 kHz, and how long after its tick was over each event was seen, ns.

    late_ns: how long after it was due the tick of this number is over.
    """
    looks, lateness, wait = 0, list[int](), _Wait()
    look = AFTER_TICK_NS
    waiting: list[int] = []
    for number, tick in enumerate(ticks):
        over = number * MS + late_ns(number)
        while look < over:
            look = wait.next_look(look)
            looks += 1
        if tick.has_struck or tick.has_released:
            waiting.append(over)
        wait.tick_ns, wait.tick = number * MS, tick
        if waiting:  # what is there is taken at the next look
            lateness += [look - each for each in waiting]
            waiting.clear()
            wait.is_open = tick.has_struck
    return looks, lateness


class _Wait:
    """The compiled wait's own steps, on a clock that is given."""

    def __init__(self) -> None:
        self.tick_ns, self._still_since_ns = -MS, 0
        self.tick, self.is_open = Tick(0.0, 1.0, False), False

    def next_look(self, now: int) -> int:
        z, v = self.tick.z_m, self.tick.v_m_per_s
        self._still_since_ns = event_wait.still_since_ns(self._still_since_ns, self.tick_ns, z, v)
        still = self.tick_ns - self._still_since_ns if self._still_since_ns != 0 else 0
        return next_look_ns(now, self.tick_ns, event_wait.quiet_ns(z, v, still, self.is_open), MS)


def played(law: Records, motion: Records, ticks: int) -> Iterator[tuple[Tick, float]]:
    """The exact stick's ticks, and the hardest pull towards the head that a flight has shown by then, m/s^2."""
    hardest = 0.0
    for _ in range(ticks):
        gone, struck, released = 0.0, False, False
        v, above = float(motion["v"][0]), float(motion["z"][0]) > 0.0
        while gone < 1e-3 and motion["outcome"][0] == exact.MOVING:
            event, moved = exact.advance(law[0], motion[0], 1e-3 - gone)
            gone += moved
            if event == exact.ENTRY:
                struck, released = True, False
            elif event == exact.RELEASE:
                struck, released = False, True
            after = float(motion["v"][0])
            if above and moved > 1e-9:
                hardest = max(hardest, (v - after) / moved)
            v, above = after, event not in (exact.ENTRY,) and float(motion["z"][0]) >= 0.0
        yield Tick(float(motion["z"][0]), float(motion["v"][0]), struck, released), hardest


def until_still(ticks: Iterable[Tick]) -> Iterator[Tick]:
    """Ticks to the second one after another at which the stick lies in the head."""
    still = 0
    for tick in ticks:
        yield tick
        still = still + 1 if is_still(tick.z_m, tick.v_m_per_s) else 0
        if still == 2:
            return


@given(
    st.floats(1e-9, 1.0),
    st.floats(-20.0, 20.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.0),
)
def test_no_pull_within_the_bound_brings_the_stick_down_sooner(
    z: float, v: float, first: float, second: float, change: float
) -> None:
    quiet_s = flight_ns(z, v) * 1e-9 * (1.0 - _PASSED)
    # Two pulls one after the other, each at most the bound.
    t1 = change * quiet_s
    v1, z1 = v - first * PULL * t1, z + v * t1 - 0.5 * first * PULL * t1**2
    t2 = quiet_s - t1
    z2 = z1 + v1 * t2 - 0.5 * second * PULL * t2**2
    assert min(z1, z2) >= -1e-9 * (z + abs(v) * quiet_s + 1e-6)
    # And it is no smaller than need be: the hardest pull does bring it down then.
    lowest = z + v * quiet_s - 0.5 * PULL * quiet_s**2
    assert lowest <= 1e-6 * (z + abs(v) * quiet_s + 1e-3) + 2e-9 * abs(v)


@pytest.mark.parametrize("z", [0.0, -1e-3, math.nan, -math.inf])
@pytest.mark.parametrize("v", [0.0, math.nan, math.inf, 0.3])
def test_a_stick_in_the_head_or_nowhere_is_looked_at_after_each_tick(z: float, v: float) -> None:
    assert flight_ns(z, v) == 0
    assert next_look_ns(100, 0, 0, MS) == MS + AFTER_TICK_NS


@settings(max_examples=150, deadline=None)
@given(likely_scenes(("pulse",)).map(eased), st.floats(0.02, 3.0))
def test_an_accepted_stick_is_seen_in_time_whatever_it_does(scene: Scene, throw: float) -> None:
    law = law_of(scene)
    if envelope.judge(law[0], Limits.of(scene).record()[0], envelope.new_scratch()).code != envelope.OK:
        return
    ticks, pulls = zip(*played(law, thrown(scene, throw), 300), strict=True)
    looks, lateness = watched(iter(ticks))
    assert max(lateness, default=0) <= MAX_SLEEP_NS
    if pulls[-1] <= PULL:  # and until it creeps in the head, where it is taken for one that lies there
        assert max(watched(until_still(ticks))[1], default=0) <= AFTER_TICK_NS
    assert looks <= 2 * len(pulls)


def test_a_roll_is_looked_at_closely_only_near_the_head() -> None:
    scene = parse(shipped_text("roll"), "roll")
    law = law_of(scene)
    looks, lateness = watched(tick for tick, _ in played(law, thrown(scene, 0.6), 2000))
    assert len(lateness) >= 40
    assert max(lateness) <= AFTER_TICK_NS
    assert looks < 1500  # of 2000 ticks


@pytest.mark.parametrize("z", [-1e-4, 0.05])
def test_a_stick_at_rest_costs_a_look_in_two_milliseconds(z: float) -> None:
    looks, _ = watched(Tick(z, 0.0, False) for _ in range(2000))
    assert looks <= 1010


def test_a_strike_that_nothing_foresaw_is_late_by_one_sleep_at_most() -> None:
    strikes = [Tick(0.05, 0.0, number % 61 == 60, number % 61 == 1) for number in range(6000)]
    _, lateness = watched(iter(strikes))
    assert MS < max(lateness) <= MAX_SLEEP_NS


def test_a_tick_that_is_late_is_awaited_closely_and_a_dead_servo_is_not() -> None:
    late = [Tick(0.0, -1.0, True) for _ in range(20)]
    _, lateness = watched(iter(late), lambda number: 10_000 + 45_000 * number)
    assert max(lateness) <= event_wait.CLOSE_NS
    assert next_look_ns(500 * MS, 0, 0, MS) == 500 * MS + MAX_SLEEP_NS


def test_a_stick_that_turns_in_the_head_is_not_taken_for_one_that_lies() -> None:
    turn = [Tick(-2e-3, v, False) for v in (-0.4, 0.0, 0.4)]
    looks, _ = watched(iter(turn * 100))
    assert looks >= 299


def test_a_stick_that_is_first_seen_when_it_turns_is_not_taken_for_one_that_lies() -> None:
    ticks = [Tick(0.05, 0.0, False)] * 7 + [Tick(-2e-3, 0.0, False), Tick(2e-3, 0.4, False, True)]
    _, lateness = watched(iter(ticks * 12))
    assert len(lateness) == 12
    assert max(lateness) <= AFTER_TICK_NS


def test_a_release_above_the_head_is_seen_after_its_tick() -> None:
    blow = [Tick(-1e-3, -1.0, True), Tick(5e-5, 1.0, False), Tick(1e-3, 1.0, False, True)]
    _, lateness = watched(iter((blow + [Tick(2e-3, 0.0, False)] * 5) * 12))
    assert len(lateness) == 24
    assert max(lateness) <= AFTER_TICK_NS


def _wait(block: Block, wake: np.ndarray, forces: np.ndarray, until_ns: int) -> int:
    awaited = event_wait.Awaited(
        block.ring_cells, forces, block.live_cells, wake, block.status_cells, block.status
    )
    return event_wait.await_events(awaited, np.zeros(1, np.int64), np.zeros(2, np.int64), MS, until_ns, False)


@pytest.fixture
def block() -> Block:
    return blocks.in_memory(law_of(parse(shipped_text("roll"), "roll")))


def test_what_is_there_already_needs_no_look(block: Block) -> None:
    wake, forces = ring.new_cells(), ring.new_cells()
    out = np.zeros(4, EVENT)
    ring.push(block.ring_cells, block.events, out[0])
    assert _wait(block, wake, forces, _FOR_EVER_NS) == 0
    assert ring.drain(block.ring_cells, block.events, out) == 1
    poke(wake, 0, 1)
    assert _wait(block, wake, forces, _FOR_EVER_NS) == 0
    assert wake[0] == 0
    triple_buffer.publish_record(block.live_cells, block.live, block.live[0])
    assert _wait(block, wake, forces, _FOR_EVER_NS) == 0
    triple_buffer.take(block.live_cells)
    poke(forces, ring.WRITTEN, 1)
    assert _wait(block, wake, forces, _FOR_EVER_NS) == 0


def test_it_ends_at_its_time_after_few_looks_at_a_stick_that_hangs_in_the_air(block: Block) -> None:
    status = np.zeros(1, STATUS)
    until_ns = time.monotonic_ns() + 20 * MS
    status["z_m"], status["t_ns"] = 0.05, until_ns
    triple_buffer.publish_record(block.status_cells, block.status, status[0])
    assert _wait(block, ring.new_cells(), ring.new_cells(), until_ns) <= 11
    assert time.monotonic_ns() >= until_ns


def test_python_goes_on_and_an_event_ends_the_wait(block: Block) -> None:
    wake, forces = ring.new_cells(), ring.new_cells()
    _wait(block, wake, forces, 0)  # compiled
    looks: list[int] = []
    waiting = threading.Thread(target=lambda: looks.append(_wait(block, wake, forces, _FOR_EVER_NS)))
    waiting.start()
    assert sum(range(100_000)) > 0
    assert looks == []
    ring.push(block.ring_cells, block.events, np.zeros(1, EVENT)[0])
    waiting.join(30.0)
    assert not waiting.is_alive()
