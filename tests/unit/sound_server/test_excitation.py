import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sound_server.excitation import POOL, PULSE, begin, mean_force, press


@given(st.floats(0.0, 300.0), st.floats(-20.0, 0.0))
def test_the_impulse_is_exact_wherever_the_onset_falls(duration: float, age: float) -> None:
    pulses = np.zeros(1, PULSE)
    begin(pulses, 0, 0, age, duration, 7.0)
    forces: list[float] = []
    while pulses[0]["age"] < pulses[0]["duration"]:
        forces.append(mean_force(pulses[0]))
        pulses[0]["age"] += 1.0
    assert sum(forces) == pytest.approx(7.0 * 2.0 / math.pi * max(duration, 1e-3), rel=1e-9)
    assert min(forces) >= -1e-12
    assert max(forces) <= 7.0 + 1e-9


def test_the_onset_may_fall_between_steps() -> None:
    pulses = np.zeros(2, PULSE)
    begin(pulses, 0, 0, 0.0, 10.0, 1.0)
    begin(pulses, 1, 0, -0.5, 10.0, 1.0)
    first, later = mean_force(pulses[0]), mean_force(pulses[1])
    # The first half step of sin(pi t / 10): its integral is 10/pi (1 - cos(pi/20)).
    assert later == pytest.approx(10.0 / math.pi * (1.0 - math.cos(math.pi / 20.0)))
    assert later < first


def test_when_the_pool_is_full_the_oldest_pulse_ends() -> None:
    pulses = np.zeros(POOL, PULSE)
    plane, weights = np.zeros(POOL + 1, np.float32), np.full(POOL + 1, 1.0, np.float32)
    begun = 0
    for junction in range(POOL + 1):
        begun = begin(pulses, begun, junction, 0.0, 100.0, 1.0)
    assert press(pulses, plane, weights, 1.0) == POOL
    assert plane[0] == 0.0
    assert (plane[1:] > 0.0).all()


def test_no_force_outside_the_head() -> None:
    pulses = np.zeros(POOL, PULSE)
    begin(pulses, 0, 1, 0.0, 5.0, 100.0)
    plane = np.zeros(3, np.float32)
    press(pulses, plane, np.zeros(3, np.float32), 1.0)
    assert not plane.any()
