"""A stick that creeps up to z = 0 and never arrives: the run ends, whatever its horizon."""

import pytest

from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.methods.carry import STEPPERS
from drumstick.stick.simulate import Stepper, simulate
from stability.catalogue import shows

# Found by chance: without a hand's spring, in a head so damped that it lets go and holds again, ever smaller.
CREEPING = Stick(2.614e-4, 361.0, 1000.0, 0.0, 0.01378, 1.0, "unilateral")


@shows("creeping stick", "ours")
def test_a_stick_that_dies_away_below_the_head_is_at_rest_there() -> None:
    """Its position and speed fall by a factor each time, down to denormal numbers that no event search can split."""
    run = simulate(Scene("creeping", stick=CREEPING), 2000.0, -0.1)
    assert run.end == "captured"
    assert len(run.contacts) == 0


@shows("creeping stick", "naive")
@pytest.mark.parametrize("method", STEPPERS)
@pytest.mark.parametrize("dt_s", [1e-3, 1e-5])
def test_a_fixed_step_throws_it_out_of_the_head_instead(method: str, dt_s: float) -> None:
    """The damper alone has a time of 0.3 us: a step of it is longer than all that happens."""
    run = simulate(Scene("creeping", stick=CREEPING), 1.0, -0.1, Stepper(method, dt_s, locates=False))
    assert run.end == "left"
    assert len(run.contacts) >= 1
