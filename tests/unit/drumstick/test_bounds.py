"""The parts that the bounds are made of, each against the stick's exact motion."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stick_cases
from drumstick import bounds, exact
from drumstick.law import law_of, thrown
from drumstick.stick import Stick


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
    assert bounds.flight_speed(law[0], v) == pytest.approx(abs(motion["v_in"][0]), rel=1e-6)


def test_without_damping_a_flight_gives_back_all() -> None:
    scene = stick_cases.scene(Stick(0.015, 4000.0, 2.0, 20.0, 0.0, -0.02, "paper"))
    law = law_of(scene)
    for v in np.geomspace(1e-3, 50.0, 20):
        assert bounds.flight_speed(law[0], v) == pytest.approx(v, rel=1e-9)
