"""[guard] limits hold for throws, re-throws, sets that change in mid-play, gestures and pointers.

On the exact stick the force is that of head and pulses, as it really acts, at every event of the exact motion; on an
arm it is the motors'.
"""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import live_sets
import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.records import EVENT, NO_FAULT, POINTER
from haptic_server.servo import loop
from haptic_server.servo.device.pointer import Pointed
from haptic_server.servo.force import memory
from realtime import ring, triple_buffer
from realtime.kernels.jit import njit

SLACK = 1.0 + 1e-9


def _scene(force_N: float, speed: float, throw: float, stick: str = "", more: str = "") -> Scene:
    text = shipped_text("roll") + f"\n[guard]\nmax_force_N = {force_N}\nmax_speed_m_per_s = {speed}\n"
    text += f"\n[hand]\nthrow_m_per_s = {throw}\nrest_s = 0.05\n{more}"
    return parse(text.replace("[stick]", f"[stick]\n{stick}"), "limits")


@njit()
def _hardest(servo: memory.Servo, ticks: int, now_ns: int) -> tuple[int, float, float]:
    # The largest force that was told at a tick, and the fastest.
    force, speed = 0.0, 0.0
    for _ in range(ticks):
        now_ns = loop.run_virtual(servo, 1, now_ns)
        motion = servo.motion[0]
        force = max(force, abs(servo.tick_state[0].force_N))
        speed = max(speed, abs(motion.v))
    return now_ns, force, speed


def _events(servo: memory.Servo) -> np.ndarray:
    out = np.zeros(16384, EVENT)
    return out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]


def test_a_throw_beyond_the_limit_of_force_is_refused() -> None:
    """1 kg at 5 m/s on 1e6 N/m made 4252 N under a limit of 100 N."""
    scene = _scene(100.0, 10.0, 5.0)
    law = law_of(scene)
    law["m"], law["k_coll"], law["r_in"], law["pulse"]["dv_pls"] = 1.0, 1e6, 200.0, 0.0
    with pytest.raises(Refusal, match=r"throw at 5 m/s .* N, the limits are 10 m/s and 100 N"):
        envelope.require(law, envelope.Limits.of(scene))


def test_a_throw_beyond_the_limit_of_speed_is_refused() -> None:
    scene = _scene(100.0, 0.1, 0.4)
    law = law_of(scene)
    law["pulse"]["dv_pls"] = 0.0
    with pytest.raises(Refusal, match=r"throw at 0\.4 m/s .* the limits are 0\.1 m/s"):
        envelope.require(law, envelope.Limits.of(scene))


VALUES = st.fixed_dictionaries(
    {},
    optional={
        "m": st.floats(math.log(0.003), math.log(0.5)).map(math.exp),
        "k_coll": st.floats(math.log(100.0), math.log(1e6)).map(math.exp),
        "r_in": st.floats(math.log(0.2), math.log(200.0)).map(math.exp),
        "k_hand": st.floats(0.0, 200.0),
        "z_ss": st.floats(-0.05, 0.02),
        "dv_pls": st.floats(0.0, 1.0),
        "tau": st.floats(math.log(1e-4), math.log(0.05)).map(math.exp),
    },
)


@settings(max_examples=150, deadline=None)
@given(
    plan=st.lists(st.tuples(VALUES, st.integers(1, 900)), min_size=1, max_size=5),
    force_N=st.floats(4.0, 100.0),
    speed=st.floats(0.5, 10.0),
    throw=st.floats(0.02, 5.0),
)
def test_no_throw_and_no_order_of_sets_passes_a_limit(
    plan: list[tuple[dict[str, float], int]], force_N: float, speed: float, throw: float
) -> None:
    """The stick is thrown whenever it lies dead, with whatever set plays then."""
    scene = _scene(force_N, speed, throw)
    limits = live_sets.limits_for(scene)
    try:
        envelope.require(law_of(scene), limits)
    except Refusal:
        assume(False)
    servo, now = live_sets.servo_of(scene), 0
    accepted = servo.law.copy()
    for revision, (changes, ticks) in enumerate(plan, 1):
        wanted = live_sets.changed(accepted, scene, changes)
        if live_sets.gateway_takes(accepted, scene, changes):
            accepted = wanted
            live_sets.offer(servo, revision, wanted)
        now, force, fastest = _hardest(servo, ticks, now)
        assert force <= force_N * SLACK
        assert fastest <= speed * SLACK
        events = _events(servo)
        assert np.all(events["peak_N"] <= force_N * SLACK)
        assert np.all(events["speed_m_per_s"] <= speed * SLACK)
    assert servo.tick_state["fault"][0] == NO_FAULT


def _pointed(scene: Scene) -> memory.Servo:
    device = Pointed(scene)
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


@pytest.mark.parametrize("plant", ["stick", "phantom"])
@pytest.mark.parametrize("over", [0.9, 1.0, 1.1])
@pytest.mark.long
def test_a_pointer_that_swings_in_time_with_the_stick_pumps_it_no_further_than_the_limit(
    plant: str, over: float
) -> None:
    """At the hand's own frequency each swing adds to the last: the hand stops where its spring would pass the limit."""
    more = "gesture_height_m = 0.2\n"
    scene = parse(
        sampled_arm.SCENE.format(guard="highest_m = 0.5", device="friction_N = 0.0", gesture="hold")
        if plant == "phantom"
        else shipped_text("roll") + f"\n[guard]\nmax_force_N = 20.0\nmax_speed_m_per_s = 2.0\n[hand]\n{more}",
        "pump",
    )
    servo, now = _pointed(scene), 0
    rate = scene.servo.rate_Hz
    own = math.sqrt(scene.stick.k_hand_N_per_m / scene.stick.m_kg) * over
    pointer = np.zeros(1, POINTER)
    pointer["held"] = 1
    fastest = hardest = 0.0
    for tick in range(6 * rate):
        pointer["t_ns"], pointer["lift"] = now, 0.5 + 0.5 * math.copysign(1.0, math.sin(own * tick / rate))
        triple_buffer.publish(servo.block.pointer_cells, servo.block.pointer, pointer[0])
        now, force, speed = _hardest(servo, 1, now)
        fastest, hardest = max(fastest, speed), max(hardest, force)
    assert servo.tick_state["fault"][0] == NO_FAULT
    assert hardest <= (8.5 if plant == "phantom" else 20.0)
    assert fastest <= (1.5 if plant == "phantom" else 2.0)
    assert fastest > 0.5  # it was pumped


@pytest.mark.parametrize("gesture", ["strokes", "single-stroke-roll", "double-stroke-roll", "press"])
@pytest.mark.parametrize("period_s", [0.05, 0.1, 0.2, 0.23])
def test_a_gesture_however_hasty_is_no_fault_in_mid_roll(gesture: str, period_s: float) -> None:
    """A hand that throws an arm at its own frequency, 20 cm high: speed and place stay within the limits, softly."""
    narrow = "highest_m = 0.05\nlowest_m = -0.02"
    text = sampled_arm.SCENE.format(guard=narrow, device="friction_N = 0.0", gesture=gesture)
    played = parse(text + f"gesture_height_m = 0.2\ngesture_period_s = {period_s}\n", "hasty")
    servo = live_sets.servo_of(played)
    _, force, speed = _hardest(servo, 10 * played.servo.rate_Hz, 0)
    assert servo.tick_state["fault"][0] == NO_FAULT
    assert force <= 8.5
    assert speed <= 1.5
