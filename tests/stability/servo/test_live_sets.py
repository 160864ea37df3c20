"""Sets that arrive while somebody plays, also in mid-contact: force stays finite, within limits, within its account.

Pairs of sets that nobody chose: what the gateway would accept, the servo accepts, and what one refuses the other does.
"""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import any_scene
import live_sets
import sampled_arm
from drumstick.scenes import table as parameters
from drumstick.stick.hand_path import GESTURES
from drumstick.stick.law import DRUM
from haptic_server.records import EVENT, NO_FAULT, PLAYING, TOO_FAST
from haptic_server.servo import loop
from live_sets import PERIOD_NS, RESOLUTION_M, WITNESS
from realtime import ring, triple_buffer
from stability.catalogue import shows

# Evenly over the decades of what a player may want, and now and then all that the table allows.
_USUAL = {
    "m": (0.01, 1.0), "k_coll": (10.0, 3500.0), "r_in": (0.05, 30.0), "k_hand": (1.0, 300.0), "r_out": (0.01, 1.0),
    "dv_pls": (1e-3, 0.5), "tau": (1e-4, 1.0),
}  # fmt: skip
_TABLE = parameters.table_of(live_sets.roll())


def _value(name: str) -> st.SearchStrategy[float]:
    anything = any_scene.over(_TABLE[name].quantity)
    if _TABLE[name].effect == DRUM:
        return anything
    if name == "z_ss":
        return st.floats(-0.05, 0.02) | anything
    low, high = _USUAL[name]
    return st.floats(math.log(low), math.log(high)).map(math.exp) | anything


SETS = st.fixed_dictionaries({}, optional={name: _value(name) for name in _TABLE if name != "z_h0"})
# Ticks between the sets, and a stall that is shorter than a fault, in ticks.
PLAN = st.lists(st.tuples(SETS, st.integers(1, 700), st.sampled_from([0, 0, 7, 15])), min_size=1, max_size=4)


@shows("parameter jump in contact", "ours")
@settings(max_examples=60)
@given(
    PLAN, st.sampled_from(GESTURES[:-1]), st.sampled_from([0.05, 0.3, 2.0]), st.sampled_from([0.0, 0.04, 0.3])
)
@example([({}, 300, 7), ({}, 700, 0)], "double-stroke-roll", 2.0, 0.0)  # a rebound out of a ramp
def test_an_arm_is_never_given_more_than_its_account(
    plan: list[tuple[dict[str, float], int, int]], gesture: str, ramp_s: float, friction_N: float
) -> None:
    played = sampled_arm.scene(gesture, f"friction_N = {friction_N}", f"ramp_s = {ramp_s}")
    servo, seen = live_sets.servo_of(played), np.zeros(1, WITNESS)
    now, refused, accepted = 0, 0, servo.law.copy()
    for revision, (changes, ticks, stall) in enumerate(plan, 1):
        now = live_sets.watched(servo, seen, ticks, now)
        if stall:
            now += stall * PERIOD_NS
            loop.traced_tick(servo, now, stall * 1e-3)
            seen["share_N"] = seen["given_J"] = 0.0
            assert servo.tick_state["force_N"][0] == 0.0
        takes = live_sets.gateway_takes(accepted, played, changes)
        wanted = live_sets.changed(accepted, played, changes)
        live_sets.offer(servo, revision, wanted)
        accepted = wanted if takes else accepted
        before = int(servo.tick_state["refused"][0])
        # Until the set was looked at, which is when the stick is above the head next, or no longer.
        for _ in range(3000):
            now = live_sets.watched(servo, seen, 1, now)
            if servo.tick_state["revision"][0] == revision or servo.tick_state["refused"][0] != before:
                break
        refused += not takes
        if servo.tick_state["refused"][0] != before:
            assert not takes
            live_sets.offer(servo, revision, accepted)
    live_sets.watched(servo, seen, 1500, now)
    assert servo.tick_state["fault"][0] in (NO_FAULT, TOO_FAST)
    assert seen["no_numbers"][0] == 0
    assert seen["force_N"][0] <= 8.5
    assert seen["growth_N"][0] <= 20.0 * (1.0 + 1e-12)
    # The servo sees positions to a count, so the work of the largest force is known to a count.
    assert seen["excess_J"][0] <= 8.5 * RESOLUTION_M
    # A stick that rests in the head has not looked yet.
    waits = servo.tick_state["is_pending"][0] == 1 or triple_buffer.has_fresh(servo.block.wanted_cells)
    assert waits or np.array_equal(servo.law, accepted)


@shows("parameter jump in contact", "ours")
@settings(max_examples=40)
@given(PLAN)
def test_a_stick_stays_within_the_envelope_whatever_comes_when(
    plan: list[tuple[dict[str, float], int, int]],
) -> None:
    played = live_sets.roll()
    limits = live_sets.limits_for(played)
    servo, out = live_sets.servo_of(played), np.zeros(16384, EVENT)
    now, accepted = 0, servo.law.copy()
    for revision, (changes, ticks, _) in enumerate(plan, 1):
        now = loop.run_virtual(servo, ticks, now)
        takes = live_sets.gateway_takes(accepted, played, changes)
        wanted = live_sets.changed(accepted, played, changes)
        before = int(servo.tick_state["refused"][0])
        live_sets.offer(servo, revision, wanted)
        for _ in range(100):
            now = loop.run_virtual(servo, 20, now)
            if servo.tick_state["revision"][0] == revision or servo.tick_state["refused"][0] != before:
                assert (servo.tick_state["refused"][0] == before) == takes
                break
        if takes:
            accepted = wanted
        else:
            live_sets.offer(servo, revision, accepted)
        events = out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]
        assert all(np.all(np.isfinite(events[name])) for name in EVENT.names or ())
        assert np.all(events["speed_m_per_s"] <= limits.max_speed_m_per_s)
        assert np.all(events["peak_N"] <= limits.max_force_N)
        assert servo.tick_state["fault"][0] == NO_FAULT
        assert np.isfinite(servo.tick_state["force_N"][0])


@pytest.mark.parametrize("plant", ["stick", "phantom"])
@settings(max_examples=150)
@given(st.data())
def test_both_fences_say_the_same(plant: str, data: st.DataObject) -> None:
    """One field, any bits: accepted by both or by neither, and what plays goes on."""
    played = live_sets.scene_of(plant)
    servo = live_sets.servo_of(played)
    name = data.draw(st.sampled_from([n for n in _TABLE if n != "z_h0"]))
    value = data.draw(_value(name) | st.floats(allow_nan=True, allow_infinity=True))
    takes = live_sets.gateway_takes(servo.law, played, {name: value})
    wanted = live_sets.changed(servo.law, played, {name: value})
    before = servo.law.copy()
    live_sets.offer(servo, 1, wanted)
    now = loop.run_virtual(servo, 20, 0)  # it looks at once: the stick starts above the head
    assert servo.tick_state["refused"][0] == (0 if takes else 1)
    if not takes:
        assert servo.law.tobytes() == before.tobytes()
        loop.run_virtual(servo, 1500, now)
        assert servo.status["status"][0] == PLAYING
