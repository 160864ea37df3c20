"""The parts that the bounds are made of, each against the stick's exact motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import bounds
from drumstick.scenes.scene_text import parse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact


@given(
    v=st.floats(0.01, 20.0),
    k_hand=st.floats(1.0, 500.0),
    r_out=st.floats(0.0, 2.0),
    z_ss=st.floats(-0.3, -0.001),
)
def test_a_flight_gives_back_the_speed_that_the_exact_stick_comes_back_with(
    v: float, k_hand: float, r_out: float, z_ss: float
) -> None:
    scene = stick_cases.scene(Stick(0.015, 4000.0, 2.0, k_hand, r_out, z_ss, "paper"))
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["z"], motion["v"] = 0.0, v
    for _ in range(20):
        event, _ = exact.advance(law[0], motion[0], 60.0)
        if event == exact.ENTRY:
            break
    assert event == exact.ENTRY
    assert bounds.flight_speed(law[0], v, float(law["r_out"][0])) == pytest.approx(
        abs(motion["v_in"][0]), rel=1e-6
    )


def test_without_damping_a_flight_gives_back_all() -> None:
    scene = stick_cases.scene(Stick(0.015, 4000.0, 2.0, 20.0, 0.0, -0.02, "paper"))
    law = law_of(scene)
    for v in np.geomspace(1e-3, 50.0, 20):
        assert bounds.flight_speed(law[0], v, float(law["r_out"][0])) == pytest.approx(v, rel=1e-9)


def _shaking(force_N: float) -> Scene:
    text = f"[stick]\nm_kg = 0.02\nk_coll_N_per_m = 800.0\n[effects.noise]\nforce_N = {force_N}\n"
    return parse(text, "shaken")


def test_forces_that_change_give_their_impulse_over_a_whole_turn() -> None:
    """By hand: F/m times the period 2 pi sqrt(m/K) on the head's spring."""
    still, shaken = (law_of(_shaking(force))[0] for force in (0.0, 0.1))
    given = 0.1 / 0.02 * 2.0 * np.pi * np.sqrt(0.02 / 800.0)
    assert bounds.speed_by_effects(shaken, 0.5) - bounds.speed_by_effects(still, 0.5) == pytest.approx(
        given, rel=1e-3
    )


def test_a_push_in_a_slow_contact_that_loses_speed_counts_whole() -> None:
    """It may come at the contact's end: what the head loses of a blow takes nothing from it."""
    slow = "[effects.negative_damping]\nr_N_s_per_m = 0.1\n"
    scenes = [
        parse(
            "[stick]\nm_kg = 0.02\nk_coll_N_per_m = 800.0\nr_in_N_s_per_m = 1.0\nz_ss_m = 0.0\n"
            f"{slow}[effects.noise]\nforce_N = {force}\n",
            "shaken slowly",
        )
        for force in (0.0, 0.1)
    ]
    still, shaken = (law_of(scene)[0] for scene in scenes)
    assert bounds.bounds_of_contact(shaken).slow.restitution < 1.0
    given = bounds.speed_by_effects(shaken, 0.0) - bounds.speed_by_effects(still, 0.0)
    assert bounds.max_added_speed_by_head(shaken) - bounds.max_added_speed_by_head(still) == pytest.approx(
        2.0 * given
    )
