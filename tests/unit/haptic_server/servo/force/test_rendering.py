"""The law on a sampled arm, in virtual time: what it plays, what it refuses, and what every fault does on its tick."""

import dataclasses
import math

import numpy as np
import pytest

import sampled_arm
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import Refusal
from drumstick.stick import contact
from drumstick.stick.law import law_of
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE, fall, filter_of
from haptic_server.block_header import ARM, PANIC
from haptic_server.limits import limits_of
from haptic_server.records import (
    FAULT_WORDS,
    NO_FAULT,
    NOT_A_NUMBER,
    RELEASE,
    SAFETY_SWITCH,
    STALE,
    STALLED,
    STRIKE,
    TOO_FAST,
    UNPLUGGED,
    set_type,
)
from haptic_server.servo import loop
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import guard, memory
from haptic_server.servo.simulation import phantom
from realtime import triple_buffer
from realtime.atomics import add_to, poke
from realtime.kernels.jit import allocations
from sampled_arm import PERIOD_NS, ask_once, events_of, render_once, servo_of
from stability.catalogue import shows

SECOND = 1000
T = PERIOD_NS * 1e-9


@pytest.fixture
def pushing() -> tuple[memory.Servo, int]:
    """A servo whose arm is pressed into the head right now, and the time of its last tick."""
    servo = servo_of(sampled_arm.scene("press"))
    now = loop.run_virtual(servo, SECOND, 0)
    for _ in range(SECOND):
        if servo.tick_state[0]["force_N"] > 0.3:
            return servo, now
        now = loop.run_virtual(servo, 1, now)
    raise AssertionError("it never pushed")


def _force(servo: memory.Servo, now_ns: int, span_s: float = T, **told: float) -> float:
    # One more reading, where the arm is, but for what is told.
    reading = servo.reading[0]
    phantom.measure(servo.plant[0], reading, now_ns)
    for name, value in told.items():
        reading[name] = value
    return render_once(servo, reading, now_ns, span_s)


def test_strokes_are_strikes_with_a_release_each() -> None:
    servo = servo_of(sampled_arm.scene("strokes"))
    loop.run_virtual(servo, 10 * SECOND, 0)
    events = events_of(servo)
    strikes, releases = events[events["kind"] == STRIKE], events[events["kind"] == RELEASE]
    assert len(strikes) >= 15
    assert len(strikes) - len(releases) in (0, 1)
    assert np.all(strikes["speed_m_per_s"] > 0.0)
    assert np.all(np.diff(strikes["t_ns"]) > 0)
    assert np.all(releases["peak_N"] <= 8.5)
    assert servo.tick_state[0]["fault"] == NO_FAULT
    # The contact's instant is found between ticks: not all strikes fall on one.
    assert np.any(strikes["t_ns"] % PERIOD_NS != 0)


def test_a_tick_allocates_nothing() -> None:
    servo = servo_of(sampled_arm.scene())
    now = loop.run_virtual(servo, 100, 0)
    counts: list[int] = []
    for ticks in (1, 5 * SECOND):  # a call from Python wraps the arrays, whatever it does with them
        before = allocations()
        now = loop.run_virtual(servo, ticks, now)
        counts.append(allocations() - before)
    assert counts[0] == counts[1]


def test_a_long_press_comes_to_rest_under_the_force_of_the_hand() -> None:
    played = sampled_arm.scene("press", device="friction_N = 0.0")
    servo = servo_of(dataclasses.replace(played, hand=dataclasses.replace(played.hand, gesture_period_s=8.0)))
    servo.law["pulse"]["dv_pls"] = 0.0  # or it would roll under the hand
    now = loop.run_virtual(servo, 4800, 0)  # lifted, then near the end of the first press
    events_of(servo)
    loop.run_virtual(servo, 200, now)
    law = servo.law[0]
    rest = law["k_hand"] * law["z_ss"] / (law["k_hand"] + law["k_coll"])
    # Without friction the counts of the encoder keep it moving by one or two: the mean is the hand's force.
    assert np.mean(servo.trace["force_N"][-200:]) == pytest.approx(-law["k_coll"] * rest, rel=0.05)
    assert np.ptp(servo.trace["z_m"][-200:]) < 4.0 * 3e-5 + 1e-4
    assert len(events_of(servo)) == 0


def test_nothing_is_rendered_before_the_stick_was_above_the_head() -> None:
    servo = servo_of(sampled_arm.scene("hold"))
    servo.plant["z_m"] = -0.02
    servo.plant["k_hand_N_per_m"] = 0.0  # nobody holds it
    loop.run_virtual(servo, 200, 0)
    assert servo.tick_state[0]["force_N"] == 0.0
    assert servo.plant[0]["z_m"] == -0.02
    servo.plant["z_m"] = 0.002
    servo.plant["v_m_per_s"] = -0.2
    servo.track["known"] = 0
    loop.run_virtual(servo, 16, 200 * PERIOD_NS)
    # 16 of 300 ms of the ramp are over: a twentieth of the head's force at the most.
    depth = -float(servo.plant[0]["z_m"])
    assert depth > 0.0005
    assert 0.0 < servo.tick_state[0]["force_N"] < 16.0 / 300.0 * (3500.0 * depth * 1.3 + 2.5 * 0.2)


FAULTS: dict[str, tuple[dict[str, float], int]] = {
    "a position that is not a number": ({"z_m": math.nan}, NOT_A_NUMBER),
    "a position beside it that is not": ({"x_m": math.nan}, NOT_A_NUMBER),
    "an infinite position": ({"z_m": math.inf}, NOT_A_NUMBER),
    "unplugged": ({"trouble": UNPLUGGED}, UNPLUGGED),
    "safety switch": ({"trouble": SAFETY_SWITCH}, SAFETY_SWITCH),
    "thrown": ({"z_m": 0.05}, TOO_FAST),
    "a stall of 21 ms": ({"span_s": 0.021}, STALLED),
    "a stall of 500 ms": ({"span_s": 0.5}, STALLED),
    "a span that is not a number": ({"span_s": math.nan}, STALLED),
}


@shows("NaN from the device", "ours")
@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_zero_force_on_the_same_tick_and_latched(
    pushing: tuple[memory.Servo, int], name: str
) -> None:
    servo, now = pushing
    told, code = FAULTS[name]
    assert _force(servo, now + PERIOD_NS, **told) == 0.0
    assert servo.tick_state[0]["fault"] == code
    assert FAULT_WORDS[code]
    for tick in range(2, 500):  # a good device again changes nothing
        assert _force(servo, now + tick * PERIOD_NS) == 0.0
    assert servo.tick_state[0]["fault"] == code
    assert events_of(servo)[-1]["kind"] == RELEASE  # no note hangs


def test_only_arm_ends_a_fault_and_only_above_the_head(pushing: tuple[memory.Servo, int]) -> None:
    servo, now = pushing
    _force(servo, now + PERIOD_NS, z_m=math.nan)
    poke(servo.block.control, ARM, 1)
    assert _force(servo, now + 2 * PERIOD_NS) == 0.0
    assert servo.tick_state[0]["fault"] == NO_FAULT
    now = loop.run_virtual(servo, 20, now + 2 * PERIOD_NS)
    assert servo.tick_state[0]["force_N"] == 0.0  # still in the head
    now = loop.run_virtual(servo, 2 * SECOND, now)
    assert np.max(servo.trace["force_N"]) > 0.3


@shows("stall", "ours")
def test_a_stall_of_ten_milliseconds_is_a_pause_not_a_fault(pushing: tuple[memory.Servo, int]) -> None:
    servo, now = pushing
    assert _force(servo, now + 10 * PERIOD_NS, 0.010) == 0.0
    assert servo.tick_state[0]["fault"] == NO_FAULT
    for tick in range(11, 40):
        held_at = float(servo.plant["z_m"][0]) - 1e-4 * (tick - 10)
        assert _force(servo, now + tick * PERIOD_NS, z_m=held_at) == 0.0
        assert servo.motion[0]["z"] == held_at  # whoever looks on sees where the stick is all the same
        assert servo.motion[0]["v"] < 0.0 or tick < 13
    assert servo.tick_state[0]["fault"] == NO_FAULT
    forces = []
    now += 40 * PERIOD_NS
    for _ in range(2 * SECOND):
        now = loop.run_virtual(servo, 1, now)
        forces.append(float(servo.tick_state[0]["force_N"]))
    assert max(forces) > 0.3
    assert servo.guard[0]["stalls"] == 1


def test_the_workspace_ends_softly_and_without_a_fault(pushing: tuple[memory.Servo, int]) -> None:
    """The head's force fades over the last centimetre, is none outside, and comes back from above the head."""
    servo, now = pushing
    lowest = float(servo.device_limits["lowest_m"][0])
    forces = []
    for tick in range(1, 101):  # pushed down evenly, 2.5 mm a tick at most
        z = float(servo.plant["z_m"][0]) + (lowest - 0.002 - float(servo.plant["z_m"][0])) * tick / 100
        servo.plant["v_m_per_s"] = 0.0
        forces.append((z - lowest, _force(servo, now + tick * PERIOD_NS, z_m=z)))
    assert servo.tick_state[0]["fault"] == NO_FAULT
    assert max(force for room, force in forces if room > 0.011) == pytest.approx(8.5)
    assert all(force <= 8.5 * room / 0.01 + 1e-9 for room, force in forces if 0.0 < room < 0.01)
    assert forces[-1][1] == 0.0
    assert servo.guard[0]["seen_above"] == 0
    now += 100 * PERIOD_NS
    forgotten = _force(servo, now + 10 * PERIOD_NS, 0.01)
    now = loop.run_virtual(servo, 3 * SECOND, now + 10 * PERIOD_NS)
    assert forgotten == 0.0
    assert servo.tick_state[0]["fault"] == NO_FAULT
    assert np.max(servo.trace["force_N"]) > 0.3


def test_a_device_that_tells_nothing_new_is_stale(pushing: tuple[memory.Servo, int]) -> None:
    servo, now = pushing
    for tick in range(1, 10):
        _force(servo, now + tick * PERIOD_NS, fresh=0)
        assert servo.tick_state[0]["fault"] == NO_FAULT
    for tick in range(10, 13):
        _force(servo, now + tick * PERIOD_NS, fresh=0)
    assert servo.tick_state[0]["fault"] == STALE


def test_panic_is_zero_force_on_the_same_tick(pushing: tuple[memory.Servo, int]) -> None:
    servo, now = pushing
    add_to(servo.block.control, PANIC, 1)
    assert _force(servo, now + PERIOD_NS) == 0.0
    assert _force(servo, now + 2 * PERIOD_NS) == 0.0
    assert events_of(servo)[-1]["kind"] == RELEASE


def test_dead_mans_button() -> None:
    servo = servo_of(sampled_arm.scene("press", guard='dead_man = "button"'))
    now = loop.run_virtual(servo, 2 * SECOND, 0)
    assert np.all(servo.trace["force_N"] == 0.0)
    servo.reading["buttons"] = 1
    now = loop.run_virtual(servo, 2 * SECOND, now)
    assert np.max(servo.trace["force_N"]) > 0.3
    servo.reading["buttons"] = 0
    loop.run_virtual(servo, 1, now)
    assert servo.tick_state[0]["force_N"] == 0.0


def test_force_and_slew_stay_within_the_limits() -> None:
    limits = "max_slew_N_per_s = 500.0"
    played = sampled_arm.scene("strokes", guard=limits)
    servo = servo_of(played)
    servo.device_limits["max_force_N"] = 1.2
    loop.run_virtual(servo, 990, loop.run_virtual(servo, 3 * SECOND, 0))
    forces = servo.trace["force_N"][: servo.tick_state[0]["traced"]]
    assert np.max(np.abs(forces)) == pytest.approx(1.2)
    assert servo.guard[0]["limited"] > 0
    # It never grows faster. It may fall at once: it must not push on when the account is empty.
    ordered = np.roll(forces, -(int(servo.tick_state[0]["traced"]) % len(forces)))
    assert np.max(np.diff(np.abs(ordered))) <= 500.0 * T * (1.0 + 1e-9)


def _falls(k: float, r_in: float, guarded: bool, device: str = "", predictor: str = "lead") -> list[float]:
    text = f"""
[stick]
m_kg = 0.075
k_coll_N_per_m = {k}
r_in_N_s_per_m = {r_in}
k_hand_N_per_m = 0.0
r_out_N_s_per_m = 0.0
z_ss_m = 0.0
[servo]
predictor = "{predictor}"
[device]
plant = "phantom"
friction_N = 0.0
{device}
"""
    servo = servo_of(parse(text, "fall"))
    own = filter_of(ADAPTIVE, T)[0]
    return [fall(servo, own, 0.3, phase / 16.0, guarded) for phase in range(16)]


@shows("late device", "ours")
@pytest.mark.parametrize("k", [500.0, 1000.0, 2000.0])
def test_with_prediction_the_head_gives_back_what_the_design_says(k: float) -> None:
    design = contact.beta_unilateral(0.075, k, 2.5)
    assert np.mean(_falls(k, 2.5, guarded=False)) == pytest.approx(design, rel=0.02)


@shows("late device", "naive")
@pytest.mark.parametrize("k", [500.0, 1000.0, 2000.0])
def test_without_prediction_lag_is_negative_damping(k: float) -> None:
    """R_eff = R_in - K T/2 in the closed form, to 2 % (the estimate of v is late as well)."""
    lag = contact.beta_unilateral(0.075, k, 2.5 - k * T / 2.0)
    found = np.mean(_falls(k, 2.5, guarded=False, predictor="off"))
    assert found == pytest.approx(lag, rel=0.02)
    assert found > contact.beta_unilateral(0.075, k, 2.5) * 1.05


@shows("head stiffer than the device")
def test_what_the_envelope_refuses_would_have_given_energy_and_the_guard_takes_it_back() -> None:
    """3500 N/m with a tick of delay at 1 kHz: a rebound faster than the blow."""
    late = "delay_ticks = 1"
    naive = _falls(3500.0, 2.5, guarded=False, device=late, predictor="off")
    assert min(naive) > 1.3
    assert max(_falls(3500.0, 2.5, guarded=True, device=late, predictor="off")) < 1.1
    played = sampled_arm.scene(device=late)
    limits = limits_of(played, Simulated(played).info().specification)
    with pytest.raises(Refusal, match="late on average"):
        envelope.require(law_of(played), limits)


@shows("pulse sampled at ticks")
def test_a_pulse_gives_its_whole_speed_at_any_rate() -> None:
    """h0 = m dv (1 - exp(-T/tau))/T: sampled at 1 kHz, a pulse of 2 ms would otherwise give 27 % too much."""
    for rate_hz in (500, 1000, 4000):
        played = sampled_arm.scene("hold")
        servo = servo_of(played)
        given, whole = _delivered(servo, 1.0 / rate_hz), servo.law[0]["m"] * 0.06
        assert given == pytest.approx(whole, rel=1e-6)
        # The naive force is the pulse's value at each tick.
        ticks = np.arange(round(0.1 * rate_hz)) / rate_hz
        naive = whole / 0.004 * np.sum(np.exp(-ticks / 0.004)) / rate_hz
        assert naive > whole * (1.0 + 0.45 / rate_hz / 0.004)


def _delivered(servo: memory.Servo, period_s: float) -> float:
    servo.motion[0]["pulse"]["acceleration"] = 0.06 / 0.004
    total = 0.0
    for _ in range(round(0.1 / period_s)):
        total += ask_once(servo, period_s)[1] * period_s
    return total


@shows("parameter jump in contact", "ours")
def test_k_coll_is_latched_above_the_head_only(pushing: tuple[memory.Servo, int]) -> None:
    servo, now = pushing
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["law"] = servo.law
    wanted["law"]["k_coll"] = 3000.0
    wanted["revision"] = 7
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])
    now = loop.run_virtual(servo, 5, now)
    assert servo.law[0]["k_coll"] == 3500.0
    servo.guard[0]["max_restitution"], servo.guard[0]["max_added_speed"] = 0.5, 0.25  # of some other law
    loop.run_virtual(servo, SECOND, now)
    assert servo.law[0]["k_coll"] == 3000.0
    assert servo.tick_state[0]["revision"] == 7
    assert (servo.guard[0]["max_restitution"], servo.guard[0]["max_added_speed"]) == guard.rebound_bounds(
        servo.law[0]
    )


@pytest.mark.parametrize(
    "change", [("k_coll", 4000.0), ("k_coll", math.nan), ("r_in", 0.6), ("m", -1.0), ("tau", 0.0)]
)
def test_the_servos_fence_knows_the_device(change: tuple[str, float]) -> None:
    """Stiffer than the device renders, less damping than its lag takes, and nonsense."""
    servo = servo_of(sampled_arm.scene())
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["law"] = servo.law
    name, value = change
    if name == "tau":
        wanted["law"]["pulse"]["tau"] = value
    else:
        wanted["law"][name] = value
    wanted["revision"] = 3
    before = servo.law.copy()
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])
    loop.run_virtual(servo, SECOND, 0)
    assert servo.tick_state[0]["refused"] == 1
    assert servo.tick_state[0]["refused_revision"] == 3
    assert servo.law[0] == before[0]


def test_ten_minutes_of_strokes_keep_time_and_place() -> None:
    servo = servo_of(sampled_arm.scene("strokes"))
    loop.run_virtual(servo, 600 * SECOND, 0)
    assert servo.tick_state[0]["fault"] == NO_FAULT
    assert servo.status[0]["strikes"] >= 1150
    assert servo.status[0]["tick"] == 600 * SECOND
