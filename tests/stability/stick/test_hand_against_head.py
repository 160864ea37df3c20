"""A hand that outdoes the head: stiffer, more damped, just as damped, or giving energy; and a pulse at the entry."""

import dataclasses
import math

import numpy as np
import pytest

import drumstick as ds
import live_sets
import stick_cases
from drumstick.parameters.stick import Stick
from drumstick.safety import envelope
from drumstick.scenes.table import Refusal
from drumstick.stick import contact
from drumstick.stick.contact_ahead import PredictedContact, contact_ahead, isolated
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick.stick.simulate import COLUMNS, simulate
from haptic_server.servo import loop
from stability.catalogue import shows

V_IN, V_OUT, T_OUT, Z_MIN = (
    COLUMNS.index(name) for name in ("v_in_m_per_s", "v_out_m_per_s", "t_out_s", "z_min_m")
)
EXIT_PULSE = Pulse(0.2, 0.002, "exit", 1)
BLOW = 0.4  # m/s


@shows("hand stiffer than the head")
@pytest.mark.parametrize("k_coll", [1.0, 100.0, 1000.0])
def test_a_hand_stiffer_than_the_head_makes_the_contact(k_coll: float) -> None:
    """1e4 N/m on a soft head: equation (3), which leaves the hand out, has another contact altogether."""
    m, r_in, k_hand = 0.015, 0.5, 1e4
    run = simulate(stick_cases.scene(Stick(m, k_coll, r_in, k_hand, 0.1, 0.0, "paper")), 0.1, -BLOW)
    k = k_coll + k_hand
    half_swing = math.pi / math.sqrt(k / m - (0.5 * r_in / m) ** 2)
    back = math.exp(-0.5 * r_in / m * half_swing)
    assert run.contacts[0, T_OUT] == pytest.approx(half_swing, rel=1e-12)
    assert run.contacts[0, V_OUT] == pytest.approx(back * BLOW, rel=1e-12)
    assert contact.contact_time(contact.PAPER, m, k_coll, r_in) > 3.0 * half_swing
    assert contact.beta_eq3(m, k_coll, r_in) < back - 0.1


def _deepest_if_asked_at_entry(stick: Stick, duration_s: float = 0.02, dt_s: float = 1e-6) -> float:
    # A loop that asks once, at z = 0, whether the head pushes, and lets the stick pass through a head that does not.
    own = stick.r_in_N_s_per_m - stick.r_out_N_s_per_m
    z, v, deepest = 0.0, -BLOW, 0.0
    pushes = -stick.k_coll_N_per_m * z - own * v > 0.0
    for _ in range(round(duration_s / dt_s)):
        push = max(-stick.k_coll_N_per_m * z - own * v, 0.0) if pushes else 0.0
        hand = -stick.k_hand_N_per_m * (z - stick.z_ss_m) - stick.r_out_N_s_per_m * v
        v += dt_s * (push + hand) / stick.m_kg
        z += dt_s * v
        deepest = min(deepest, z)
    return deepest


def _deepest(stick: Stick) -> float:
    return float(simulate(stick_cases.scene(stick), 0.05, -BLOW).contacts[0, Z_MIN])


@shows("head softer than the hand's damper")
@pytest.mark.parametrize("r_out", [0.2, 0.4, 3.0])
def test_a_head_that_would_pull_at_entry_pushes_a_little_deeper(r_out: float) -> None:
    """R_in below R_out: at z = 0 the head's own damper is negative. It lets go there and holds just below."""
    stick = Stick(0.015, 5000.0, 0.05, 20.0, r_out, -0.02, "unilateral")
    assert _deepest_if_asked_at_entry(stick) < 3.0 * _deepest(stick)
    assert _deepest_if_asked_at_entry(dataclasses.replace(stick, r_out_N_s_per_m=0.0)) == pytest.approx(
        _deepest(dataclasses.replace(stick, r_out_N_s_per_m=0.0)), rel=1e-3
    )  # the loop is right where the head pushes at once
    run = simulate(stick_cases.scene(stick, EXIT_PULSE), 2.0, -BLOW)
    assert np.all(np.isfinite(run.contacts))
    assert len(run.contacts) >= 40
    assert np.all(
        np.diff(run.contacts[:, 0]) > 5e-3
    )  # each blow is one contact, however often the head lets go in it
    assert np.all(run.contacts[:, V_OUT] <= -run.contacts[:, V_IN])


@shows("both releases at once")
@pytest.mark.parametrize("r", [0.0, 0.1])
def test_a_head_without_a_damper_of_its_own_lets_go_at_the_surface(r: float) -> None:
    """R_in = R_out: it stops pushing just where z = 0, and its push at the entry is exactly 0."""
    stick = Stick(0.015, 5000.0, r, 20.0, r, -0.02, "unilateral")
    assert _deepest_if_asked_at_entry(stick) < 3.0 * _deepest(stick)
    by_force = simulate(stick_cases.scene(stick, EXIT_PULSE), 2.0, -BLOW)
    by_height = simulate(
        stick_cases.scene(dataclasses.replace(stick, release="paper"), EXIT_PULSE), 2.0, -BLOW
    )
    assert len(by_force.contacts) == len(by_height.contacts) > 20
    np.testing.assert_allclose(by_force.contacts, by_height.contacts, rtol=1e-11, atol=1e-13)


@shows("hand that gives energy")
def test_a_negative_damper_of_the_hand_grows_without_a_pulse_and_is_refused_everywhere() -> None:
    """R_out = -0.05 N s/m: played by the method alone, which asks nobody, 0.4 m/s become more than 1 m/s."""
    stick = Stick(0.015, 5000.0, 1.3, 20.0, -0.05, 0.01, "paper")
    naive = simulate(stick_cases.scene(stick), 20.0, -BLOW).contacts
    assert -naive[-1, V_IN] > 2.5 * BLOW

    with pytest.raises(ds.SceneError, match="r_out"):
        ds.scene("roll", r_out=-0.05)
    with pytest.raises(ValueError, match=r"stick.r_out_N_s_per_m: -0.05 N s/m is outside 0 .. 1000 N s/m"):
        ds.simulate(stick_cases.scene(stick), 1.0)
    scene = live_sets.roll()
    law = law_of(scene)
    assert not live_sets.gateway_takes(law, scene, {"r_out": -0.05})
    wanted = live_sets.changed(law, scene, {"r_out": -0.05})
    with pytest.raises(Refusal):
        envelope.require(wanted, live_sets.limits_for(scene))
    servo = live_sets.servo_of(scene)
    live_sets.offer(servo, 3, wanted)
    loop.run_virtual(servo, 1000, 0)
    assert servo.tick_state["refused_revision"][0] == 3
    assert servo.law["r_out"][0] == law["r_out"][0]


@shows("pulse at the entry")
@pytest.mark.parametrize("dv", [0.2, 1.0])
def test_a_pulse_at_the_entry_is_in_what_the_strike_announces(dv: float) -> None:
    """The drum is struck by the announcement: the blow's speed alone tells another force, or another length."""
    scene = stick_cases.scene(stick_cases.STICK_A, Pulse(dv, 0.002, "entry", 1))
    law, motion = law_of(scene), thrown(scene, BLOW)
    announced, naive, real = list[PredictedContact](), list[PredictedContact](), list[PredictedContact]()
    while len(real) < 20:
        what, _ = exact.advance(law[0], motion[0], 1.0)
        if what == exact.ENTRY:
            announced.append(contact_ahead(law[0], motion[0], motion.copy()))
            naive.append(isolated(law[0], -float(motion["v_in"][0])))
        elif what == exact.RELEASE:
            real.append(PredictedContact(*(float(motion[name][0]) for name in PredictedContact._fields)))
    np.testing.assert_allclose(announced[:20], real, rtol=1e-9)
    off = np.abs(np.array(naive[:20]) / np.array(real) - 1.0)
    assert np.all(off.max(axis=1) > 0.2)
