"""A mallet against a wall: contact time over speed, and what the loss takes."""

import numpy as np
import pytest

from mallets import on_a_wall, tip_of

STEP_S = 1.0 / 48_000.0


def _blow(
    stiffness: float, exponent: float, loss: float, speed: float, step_s: float = STEP_S
) -> tuple[float, float]:
    tips = np.array([tip_of(stiffness, exponent, loss, step_s, 1.0)])
    return on_a_wall(tips, 0.02, speed, step_s)


@pytest.mark.parametrize(("exponent", "stiffness"), [(1.5, 1e5), (2.5, 1e7), (3.0, 1e8)])
def test_without_loss_contact_time_goes_with_the_power_of_the_speed(
    exponent: float, stiffness: float
) -> None:
    """t_c ~ v^(-(p-1)/(p+1)), as for any mass on a spring of this power."""
    speeds = 0.5 * 2.0 ** np.arange(5)
    times = np.array([_blow(stiffness, exponent, 0.0, float(v))[0] for v in speeds])
    wanted = times[0] * (speeds / speeds[0]) ** (-(exponent - 1.0) / (exponent + 1.0))
    np.testing.assert_allclose(times, wanted, rtol=0.01)
    assert times[0] > 1.3 * times[-1]


@pytest.mark.parametrize("exponent", [1.5, 2.0, 3.0])
def test_without_loss_it_comes_back_as_fast(exponent: float) -> None:
    assert _blow(1e7, exponent, 0.0, 1.0)[1] == pytest.approx(1.0, abs=1e-8)


@pytest.mark.parametrize("exponent", [1.5, 2.5])
def test_the_loss_is_that_of_hunt_and_crossley(exponent: float) -> None:
    """Restitution 1 - (2/3) lambda v for little loss, whatever the power (their equation 20)."""
    for loss in (0.02, 0.04):
        assert 1.0 - _blow(1e7, exponent, loss, 1.0, 1e-6)[1] == pytest.approx(2.0 / 3.0 * loss, rel=0.04)
