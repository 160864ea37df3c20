"""Effects are put together by the compiler: the step is that of a loop written by hand (its time: lab step-cost)."""

import pytest

import plain_steps
import steps


@pytest.mark.parametrize("count", steps.RACES)
def test_the_composed_step_is_the_plain_one_to_the_last_bit(count: int) -> None:
    race = steps.RACES[count]
    for taken in (1, 1000, 4321, steps.STEPS):
        z, v, blow = race.plain(taken)
        motion = race.composed(taken)
        assert (motion["z"][0], motion["v"][0]) == (z, v)
        assert {name: float(motion[name][0]) for name in plain_steps.Blow._fields} == blow._asdict()
    assert motion["v_in"][0] < 0.0 < motion["v_out"][0] or motion["contact_phase"][0] != 0  # it has struck
    assert len(race.scene.effects) == count
