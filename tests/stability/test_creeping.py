"""A stick that creeps up to z = 0 and never arrives: the run ends, whatever its horizon."""

from drumstick.scene import Scene
from drumstick.simulate import simulate
from drumstick.stick import Stick

# Found by chance: without a hand's spring, in a head so damped that it lets go and holds again, ever smaller.
CREEPING = Stick(2.614e-4, 361.0, 1000.0, 0.0, 0.01378, 1.0, "unilateral")


def test_a_stick_that_dies_away_below_the_head_is_at_rest_there() -> None:
    """Its position and speed fall by a factor each time, down to denormal numbers that no event search can split."""
    run = simulate(Scene("creeping", stick=CREEPING), 2000.0, -0.1)
    assert run.end == "captured"
    assert len(run.contacts) == 0
