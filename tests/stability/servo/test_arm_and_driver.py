"""An arm that is not what the set says, a throw no set should make, and a driver that lets go."""

import dataclasses

import numpy as np
import pytest

import live_sets
import sampled_arm
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of
from drumstick.stick.simulate import COLUMNS, simulate
from haptic_server.records import NO_FAULT, TOO_FAST
from haptic_server.servo import loop
from stability.catalogue import shows

ARM_KG, LIMIT_N = 0.075, 8.5
PEAK = COLUMNS.index("peak_force_N")


@shows("throw outside the guard")
def test_numbers_that_are_each_in_range_throw_beyond_the_limit_of_force() -> None:
    """1 kg at 5 m/s on 1e6 N/m: the sound and the page would be told of thousands of newtons."""
    played = parse(
        f"{shipped_text('roll')}\n[guard]\nmax_force_N = 100.0\n[hand]\nthrow_m_per_s = 5.0\n", "thrown"
    )
    stick = dataclasses.replace(played.stick, m_kg=1.0, k_coll_N_per_m=1e6, r_in_N_s_per_m=200.0)
    scene = dataclasses.replace(played, stick=stick, effects={})
    naive = simulate(scene, 1.0, -5.0).contacts
    assert naive[0, PEAK] > 40.0 * 100.0
    with pytest.raises(Refusal, match=r"throw at 5 m/s .* N, the limits are"):
        envelope.require(law_of(scene), envelope.Limits.of(scene))


@shows("arm mass other than the scene's")
def test_a_pulse_for_a_stick_heavier_than_the_arm_throws_it_too_fast() -> None:
    """A pulse is m dv: with a set of 1 kg in front of 75 g, each is thirteen times as fast as it says."""
    scene = sampled_arm.scene("hold")
    naive = sampled_arm.servo_of(scene)
    naive.law["m"] = 1.0
    loop.run_virtual(naive, 4000, 0)
    assert naive.tick_state["fault"][0] == TOO_FAST

    servo = sampled_arm.servo_of(scene)
    wanted = live_sets.changed(law_of(scene), scene, {"m": 1.0})
    assert not live_sets.gateway_takes(law_of(scene), scene, {"m": 1.0})
    live_sets.offer(servo, 1, wanted)
    loop.run_virtual(servo, 4000, 0)
    assert servo.tick_state["refused_revision"][0] == 1
    assert servo.tick_state["fault"][0] == NO_FAULT
    assert np.max(np.abs(servo.trace["force_N"])) > 0.3  # and it plays on


def _blow(lets_go: bool, speed: float = 1.2) -> tuple[float, float]:
    # The plain head of 3500 N/m under a driver that clamps a force above its limit, or lets go: the depth, and the
    # speed after 30 ms.
    z, v, deepest = 0.0, -speed, 0.0
    for _ in range(300):
        force = max(-3500.0 * z, 0.0)
        if force > LIMIT_N:
            force = 0.0 if lets_go else LIMIT_N
        v += 1e-4 * force / ARM_KG
        z += 1e-4 * v
        deepest = min(deepest, z)
    return deepest, v


@shows("driver that lets go above its limit")
def test_a_force_that_vanishes_above_a_limit_lets_the_arm_through_the_head() -> None:
    """Some drivers send nothing in place of too much: the deeper the arm is, the surer it meets no head."""
    assert _blow(lets_go=False)[1] > 0.0
    through, still_down = _blow(lets_go=True)
    assert still_down < -0.5
    assert through < -0.02

    servo = sampled_arm.servo_of(sampled_arm.scene("hold"))
    now = loop.run_virtual(servo, 1000, 0)
    servo.plant["z_m"], servo.plant["v_m_per_s"] = 0.004, -1.2
    servo.track["known"] = 0
    sent, deepest = list[float](), 0.0
    for _ in range(100):
        now = loop.run_virtual(servo, 1, now)
        sent.append(float(servo.tick_state["force_N"][0]))
        deepest = min(deepest, float(servo.plant["z_m"][0]))
    assert max(sent) == pytest.approx(LIMIT_N)  # such a blow does ask for all that the motors have
    assert all(abs(force) <= LIMIT_N for force in sent)
    assert deepest > -0.02
    assert float(servo.plant["z_m"][0]) > 0.0
