"""Both fences, one field at a time, on both plants: refused whole, nothing of a set is kept, the old one plays on."""

import math
from pathlib import Path

import numpy as np
import pytest

import live_sets
from drumstick.safety import envelope
from drumstick.scenes import table as parameters
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.settings import Parameters
from haptic_server.records import NO_FAULT, OUT_OF_BOUNDS, PLAYING, STALLED
from haptic_server.servo import loop
from haptic_server.servo.force.guard import STALL_FAULT_S, STALL_PAUSE_S
from live_sets import PERIOD_NS, T
from realtime import triple_buffer
from stability.catalogue import shows

PLANTS = ("stick", "phantom")
TABLE = parameters.table_of(live_sets.roll())
SET_DIRECTLY = tuple(name for name in TABLE if name != "z_h0")
NEVER = (math.nan, math.inf, -math.inf, 1e308, -1e308, 1e12, -61.0)
# What besides is no value of each; -0.0 is 0, and that is no mass, no stiffness and no duration.
NOT_THIS = {
    "m": (0.0, -0.0, 5e-324, 1e-5),
    "k_coll": (0.0, -0.0, 5e-324, 1e7),
    "tau": (0.0, -0.0, 5e-324, 1e-12),
    "dv_pls": (1e6, -1e-3, -5e-324),
    "r_in": (-1e-3, -5e-324, 0.0),
    "r_out": (-1e-3, -5e-324),
    "k_hand": (-1e-3, -5e-324),
    "z_ss": (2.0, -2.0),
    "z_h0": (2.0, -2.0),
    "drum.f01": (0.0, 19.0, 2001.0),
    "drum.t60": (0.0, 0.01, 61.0),
    "listen.gain": (12.5,),
    "listen.pan": (-1.1, 1.1),
    "listen.mute": (-1e-3, 1.1),
}
GOOD = {"stick": {"dv_pls": 0.15, "k_hand": 25.0}, "phantom": {"dv_pls": 0.05, "k_hand": 55.0}}


def _beside(plant: str, name: str) -> dict[str, float]:
    return {n: v for n, v in GOOD[plant].items() if n != name}


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("name", TABLE)
def test_the_gateways_fence_refuses_the_whole_set(tmp_path: Path, plant: str, name: str) -> None:
    played = live_sets.scene_of(plant)
    mine = blocks.create(tmp_path, law_of(played))
    parameters = Parameters(played, ServoLink(tmp_path, law_of(played)), live_sets.limits_for(played))
    before, offered = parameters.values(), mine.wanted.tobytes()
    for value in (*NEVER, *NOT_THIS[name]):
        for changes in ({name: value, **_beside(plant, name)}, {**_beside(plant, name), name: value}):
            with pytest.raises(Refusal, match=r"\w"):
                parameters.set(changes, "test")
    assert parameters.values() == parameters.accepted_values() == before
    assert (parameters.revision, parameters.pending) == (0, False)
    assert mine.wanted.tobytes() == offered


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("name", SET_DIRECTLY)
def test_the_servos_fence_refuses_the_whole_set_and_plays_on(plant: str, name: str) -> None:
    played = live_sets.scene_of(plant)
    servo = live_sets.servo_of(played)
    now, before = loop.run_virtual(servo, 1000, 0), servo.law.tobytes()
    bad = (*NEVER, *NOT_THIS[name])
    for revision, value in enumerate(bad, 1):
        wanted = live_sets.changed(servo.law, played, {name: value, **_beside(plant, name)})
        live_sets.offer(servo, revision, wanted)
        for _ in range(2000):
            now = loop.run_virtual(servo, 1, now)
            if servo.tick_state["refused"][0] == revision:
                break
        assert servo.tick_state["refused"][0] == servo.tick_state["refused_revision"][0] == revision
        assert servo.law.tobytes() == before
    struck = int(servo.tick_state["seq"][0])
    loop.run_virtual(servo, 3000, now)
    assert servo.tick_state["seq"][0] > struck
    assert servo.status["status"][0] == PLAYING
    assert servo.tick_state["revision"][0] == 0


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("sign", 1_000_000),
        ("sign", 0),
        ("trigger", 7),
        ("overlap", -1),
        ("release", 2),
        ("g_star_m_per_s2", math.nan),
    ],
)
def test_what_cannot_be_set_live_must_be_the_scenes(plant: str, field: str, value: float) -> None:
    """A damaged block: a sign of a million would multiply each pulse, and no envelope knows of it."""
    played = live_sets.scene_of(plant)
    servo = live_sets.servo_of(played)
    wanted = servo.law.copy()
    (wanted["pulse"] if field in ("sign", "trigger", "overlap") else wanted)[field] = value
    before = servo.law.tobytes()
    live_sets.offer(servo, 1, wanted)
    loop.run_virtual(servo, 2000, 0)
    assert servo.tick_state["refused"][0] == 1
    assert servo.law.tobytes() == before
    assert servo.status["status"][0] == PLAYING


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize(
    "names", [("dv_pls", "z_ss"), ("k_hand", "r_out"), ("dv_pls", "z_ss", "k_hand", "r_out")]
)
def test_minus_zero_is_zero(plant: str, names: tuple[str, ...]) -> None:
    """Zero has two signs and is one value: the stick moves alike, bit by bit, and no tick lasts for ever."""
    played, ends = live_sets.scene_of(plant), []
    for zero in (0.0, -0.0):
        servo = live_sets.servo_of(played)
        live_sets.offer(servo, 1, live_sets.changed(servo.law, played, dict.fromkeys(names, zero)))
        loop.run_virtual(servo, 3000, 0)
        assert servo.tick_state["revision"][0] == 1
        assert servo.tick_state["fault"][0] == NO_FAULT
        ends.append(servo.trace.tobytes())
    assert ends[0] == ends[1]


def test_the_gateway_offers_zero_for_minus_zero(tmp_path: Path) -> None:
    played = live_sets.roll()
    mine = blocks.create(tmp_path, law_of(played))
    parameters = Parameters(played, ServoLink(tmp_path, law_of(played)))
    reply = parameters.set({"k_hand": -0.0, "r_out": -0.0, "dv_pls": -0.0}, "test")
    assert all(math.copysign(1.0, value) == 1.0 for value in reply.values.values())
    law = mine.wanted["law"][triple_buffer.take(mine.wanted_cells)]
    assert [math.copysign(1.0, law[name]) for name in ("k_hand", "r_out")] == [1.0, 1.0]


def test_what_was_looked_at_is_what_is_used() -> None:
    """The set that plays is the servo's own copy: whatever happens to the block afterwards is not in it."""
    played = live_sets.roll()
    servo = live_sets.servo_of(played)
    live_sets.offer(servo, 1, live_sets.changed(servo.law, played, {"dv_pls": 0.3}))
    now = loop.run_virtual(servo, 20, 0)
    servo.block.wanted["law"]["m"] = math.nan
    servo.block.live["law"]["m"] = math.nan
    loop.run_virtual(servo, 1000, now)
    assert servo.law["m"][0] == 0.015
    assert servo.status["status"][0] == PLAYING


def _in_head(plant: str) -> tuple[live_sets.memory.Servo, int]:
    servo = live_sets.servo_of(live_sets.scene_of(plant))
    now = loop.run_virtual(servo, 1000, 0)
    while not servo.tick_state["force_N"][0] > 0.3:
        now = loop.run_virtual(servo, 1, now)
    return servo, now


@shows("stall", "ours")
@pytest.mark.parametrize("stall_ms", [4, 6, 10, 19, 21, 50, 500])
def test_a_stall_of_an_arm_is_a_pause_and_then_a_fault(stall_ms: int) -> None:
    servo, now = _in_head("phantom")
    now += stall_ms * PERIOD_NS
    loop.traced_tick(servo, now, stall_ms * T)
    paused, fault = stall_ms * T > STALL_PAUSE_S, stall_ms * T > STALL_FAULT_S
    assert servo.tick_state["fault"][0] == (STALLED if fault else NO_FAULT)
    if paused:
        assert servo.tick_state["force_N"][0] == 0.0
        assert servo.guard["seen_above"][0] == 0
    forces, above_at = [], 0
    for tick in range(1500):
        now = loop.run_virtual(servo, 1, now)
        forces.append(float(servo.tick_state["force_N"][0]))
        above_at = above_at or tick * int(servo.guard["seen_above"][0])
    if fault:
        assert not any(forces)
    elif paused:
        first = next(tick for tick, force in enumerate(forces) if force != 0.0)
        assert first > above_at > 0  # nothing before it was seen above the head
        assert max(forces) > 0.3
        # The ramp takes 300 ms: a tenth of it is a tenth of the force.
        assert max(forces[above_at : above_at + 30], default=0.0) <= 0.1 * 8.5
    else:
        assert max(forces) > 0.3


@pytest.mark.parametrize("stall_ms", [4, 10, 50, 500])
def test_a_stall_of_the_exact_stick_is_a_longer_span_and_no_burst(stall_ms: int) -> None:
    """No motor, no fault: it covers 20 ms at the most, and goes on where it is."""
    servo, now = _in_head("stick")
    smooth, then = _in_head("stick")
    now += stall_ms * PERIOD_NS
    loop.traced_tick(servo, now, stall_ms * T)
    loop.run_virtual(smooth, min(stall_ms, 20), then)
    assert servo.tick_state["fault"][0] == NO_FAULT
    assert servo.tick_state["seq"][0] == smooth.tick_state["seq"][0]
    np.testing.assert_allclose(servo.motion["z"], smooth.motion["z"], rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(servo.motion["v"], smooth.motion["v"], rtol=1e-9)
    assert np.max(np.abs(servo.motion["z"])) < 0.1


def test_a_clock_that_goes_back_is_a_fault_of_an_arm() -> None:
    servo, now = _in_head("phantom")
    loop.traced_tick(servo, now + PERIOD_NS, -T)
    assert servo.tick_state["fault"][0] == STALLED
    assert servo.tick_state["force_N"][0] == 0.0


@shows("NaN from the device", "ours")
@pytest.mark.parametrize("field", ["k_coll", "r_in", "m"])
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_force_that_is_no_number_is_a_fault_on_the_same_tick(field: str, value: float) -> None:
    """As if both fences had failed."""
    servo, now = _in_head("phantom")
    servo.law[field] = value
    if field == "m":
        servo.motion["pulse"]["acceleration"] = 1.0
    loop.run_virtual(servo, 1, now)
    assert servo.tick_state["force_N"][0] == 0.0
    assert servo.tick_state["fault"][0] == OUT_OF_BOUNDS


def test_unplugging_one_end_of_the_envelope_is_refused_too() -> None:
    """A limit that is not a number lets nothing pass, at either fence."""
    played = live_sets.roll()
    servo = live_sets.servo_of(played)
    servo.envelope_limits["max_force_N"] = math.nan
    live_sets.offer(servo, 1, servo.law)
    loop.run_virtual(servo, 20, 0)
    assert servo.tick_state["refused"][0] == 1
    with pytest.raises(Refusal):
        envelope.require(servo.law, envelope.Limits(math.nan, 10.0))
