"""The envelope at its borders: each limit is itself allowed, and what a refusal says, to the word."""

import math

import pytest

from drumstick.parameters.scene import Scene
from drumstick.safety import bounds, envelope
from drumstick.safety.envelope import Limits, judge, new_scratch, predicted, require
from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import Refusal
from drumstick.stick.law import Records, law_of

T = 1e-3
ARM = Limits(8.5, 1.5, 0.0, 3500.0, T, 0, T / 2.0, 0.064, 0.15, 500.0, 3e-5)


def _bare(effects: str = "", **values: float) -> Records:
    law = law_of(parse(effects, "bare") if effects else Scene("bare"))
    for name, value in {"k_hand": 0.0, "r_out": 0.0, **values}.items():
        law[name] = value
    return law


def _judged(law: Records, limits: Limits) -> envelope.Judgement:
    return judge(law[0], limits.record()[0], new_scratch())


def _said(law: Records, limits: Limits) -> str:
    with pytest.raises(Refusal) as refused:
        require(law, limits)
    return str(refused.value)


def _just_below(value: float) -> float:
    return math.nextafter(value, 0.0)


PULSE = "[effects.pulse]\ndv_m_per_s = 0.5\ntau_s = 0.001\n"


def test_a_roll_at_the_limit_of_speed_is_taken() -> None:
    law = _bare(PULSE)
    speed, _ = predicted(law[0], 0.0)
    assert _judged(law, Limits(math.inf, speed)).code == envelope.OK
    assert _judged(law, Limits(math.inf, _just_below(speed))).code == envelope.SPEED


def test_a_roll_at_the_limit_of_force_is_taken() -> None:
    law = _bare(PULSE)
    _, force = predicted(law[0], 0.0)
    assert _judged(law, Limits(force, 50.0)).code == envelope.OK
    assert _judged(law, Limits(_just_below(force), 50.0)).code == envelope.FORCE


def test_a_throw_at_either_limit_is_taken() -> None:
    """In no hand and without pulses it only slows down: 4 m/s is the most that it comes to."""
    law = _bare()
    _, force = predicted(law[0], 4.0)
    assert _judged(law, Limits(force, 4.0, 4.0)).code == envelope.OK
    assert _judged(law, Limits(force, _just_below(4.0), 4.0)).code == envelope.THROW
    assert _judged(law, Limits(_just_below(force), 4.0, 4.0)).code == envelope.THROW


def test_a_hand_at_the_limit_of_speed_is_not_what_is_refused() -> None:
    law = _bare(k_hand=20.0, z_ss=0.1, r_out=0.1)
    speed = bounds.hand_speed(law[0])
    assert _judged(law, Limits(100.0, speed)).code != envelope.HAND
    assert _judged(law, Limits(100.0, _just_below(speed))).code == envelope.HAND


@pytest.mark.parametrize(
    ("effects", "offered"),
    [
        ("", "lower k_coll or k_hand, or raise tau or r_in"),
        (PULSE, "lower dv_pls, k_coll or k_hand, or raise tau or r_in"),
        (PULSE + "[effects.noise]\n", "lower dv_pls and noise.force, k_coll or k_hand, or raise tau or r_in"),
    ],
)
def test_a_set_that_is_too_strong_names_what_adds_to_it(effects: str, offered: str) -> None:
    words = _said(_bare(effects, k_hand=20.0, z_ss=-0.02), Limits(0.1, 10.0))
    assert words.endswith(f"the limit is 0.1 N: {offered}")


def _on_an_arm(r: float) -> Records:
    return _bare(m=0.075, k_coll=400.0, r_in=r, k_hand=60.0, r_out=0.1, z_ss=-0.01)


def _highest_damping() -> float:
    low, high = 4.0, 400.0
    for _ in range(50):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if _judged(_on_an_arm(middle), ARM).code == envelope.OK else (low, middle)
    return low


def test_a_damping_is_looked_for_up_to_fourteen_steps_of_a_half_away() -> None:
    highest = _highest_damping()
    for steps, offered in ((13.5, True), (14.0, True), (14.5, False)):
        words = _said(_on_an_arm(highest * 1.5**steps * 0.999), ARM)
        assert ("lower r_in to" in words) == offered
        if offered:
            value = float(words.split("lower r_in to ")[1].split()[0])
            assert highest / (1.5 ** (1.0 / 32.0) * 1.01) <= value <= highest
