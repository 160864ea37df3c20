"""Dense samples of the exact motion."""

import dataclasses

import numpy as np
import pytest

from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.simulate import simulate
from drumstick.stick.trajectory import onward, trajectory
from stick_cases import STICK_A, advance_by, scene

ROLL = scene(STICK_A, Pulse(0.2, 0.002, "exit", 1))


def test_each_sample_is_the_motion_at_its_time():
    path = trajectory(ROLL, 0.4, 0.2, 401)
    for i in (0, 37, 200, 400):
        law, motion = law_of(ROLL), thrown(ROLL, 0.4)
        advance_by(law, motion, float(path.t_s[i]))
        assert path.z_m[i] == pytest.approx(float(motion["z"][0]), abs=1e-14)
        assert path.v_m_per_s[i] == pytest.approx(float(motion["v"][0]), abs=1e-11)


def test_the_force_acts_only_in_the_head_and_has_the_contacts_peak_and_impulse():
    run = simulate(ROLL, 0.2, 0.4)
    path = trajectory(ROLL, 0.4, 0.2, 40_001)
    assert not path.force_N[path.z_m > 0.0].any()
    first = run.contacts[0]
    inside = (path.t_s >= first[0]) & (path.t_s <= first[2])
    assert path.force_N[inside].max() == pytest.approx(first[5], rel=1e-5)
    assert np.trapezoid(path.force_N[inside], path.t_s[inside]) == pytest.approx(first[6], rel=1e-3)


def test_going_on_from_a_motion_gives_the_same_samples():
    whole = trajectory(ROLL, 0.4, 0.2, 201)
    law, motion = law_of(ROLL), thrown(ROLL, 0.4)
    advance_by(law, motion, 0.1)
    later = onward(law, motion, 0.1, 101)
    np.testing.assert_allclose(later.z_m, whole.z_m[100:], atol=1e-14)
    np.testing.assert_allclose(later.t_s, whole.t_s[:101], atol=1e-15)


def test_a_captured_stick_swings_into_its_rest():
    path = trajectory(scene(STICK_A), 0.01, 1.0, 2001)
    rest = STICK_A.k_hand_N_per_m * STICK_A.z_ss_m / (STICK_A.k_hand_N_per_m + STICK_A.k_coll_N_per_m)
    assert path.z_m[-1] == pytest.approx(rest, rel=1e-6)
    assert path.force_N[-1] == pytest.approx(-STICK_A.k_coll_N_per_m * rest, rel=1e-6)


def test_a_stick_that_nothing_presses_or_lifts_lies_on_the_head():
    lying = scene(dataclasses.replace(STICK_A, z_ss_m=0.0, r_out_N_s_per_m=1.0))
    path = trajectory(lying, 0.0, 0.1, 11)
    assert not path.z_m.any()
    assert not path.v_m_per_s.any()


@pytest.mark.parametrize(
    ("duration_s", "points"), [(1.0, 1), (0.0, 10), (float("inf"), 10), (float("nan"), 10)]
)
def test_no_samples_are_refused(duration_s: float, points: int):
    with pytest.raises(ValueError, match="2 points or more"):
        trajectory(ROLL, 0.4, duration_s, points)
