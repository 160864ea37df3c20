"""A simulated drummer who holds an unstable roll, beside the linear theory of a feedback that comes so much later."""

import dataclasses
import functools

import numpy as np
import pytest

from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.return_step import (
    MAX_WAIT_DOUBLINGS,
    MEASURED_SIZE,
    STATE_SIZE,
    iterate,
    scratch_of,
    set_state,
)
from drumstick.analysis.steadying import Drummer, held_s, share_held, unstable_roll
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of

LITERAL = parse(shipped_text("cor-literal"), "cor-literal")
_STEP = 1e-5


@functools.cache  # not on import: every worker imports every file
def _roll() -> Cycle:
    return unstable_roll(LITERAL)


def _next_v_e(speed: float, r_out: float) -> float:
    """Speed at the next release, from that at one, with another R_out: relative to the roll's and the scene's."""
    stick = dataclasses.replace(LITERAL.stick, r_out_N_s_per_m=r_out * LITERAL.stick.r_out_N_s_per_m)
    law, scratch = law_of(dataclasses.replace(LITERAL, stick=stick)), scratch_of(LITERAL)
    state = np.array(_roll().states[0])
    state[0] *= speed
    set_state(law[0], scratch[1:2], scratch[0:1], state)
    states, measured = np.zeros((1, STATE_SIZE)), np.zeros((1, MEASURED_SIZE))
    iterate(law[0], scratch[0], states, MAX_WAIT_DOUBLINGS, measured)
    return float(states[0, 0] / _roll().states[0][0])


@functools.cache
def _slopes() -> tuple[float, float]:
    """By how much the next strike grows with this one, and falls with the grip between them, from the motion itself."""
    mu = (_next_v_e(1.0 + _STEP, 1.0) - _next_v_e(1.0 - _STEP, 1.0)) / (2.0 * _STEP)
    c = -(_next_v_e(1.0, 1.0 + _STEP) - _next_v_e(1.0, 1.0 - _STEP)) / (2.0 * _STEP)
    assert mu == pytest.approx(_roll().multiplier, rel=1e-4)
    assert c > 0.0
    return mu, c


def _largest_root(gain: float, strikes: int) -> float:
    """Modulus of the largest root of e(k+1) = mu e(k) - c gain e(k - strikes)."""
    mu, c = _slopes()
    polynomial = np.zeros(strikes + 2)
    polynomial[:2] = 1.0, -mu
    polynomial[-1] += c * gain
    return float(np.abs(np.roots(polynomial)).max())


@pytest.mark.parametrize("gain", [4.0, 5.0, 8.0, 10.0])
def test_the_longest_delay_is_that_of_the_linear_theory(gain: float) -> None:
    """Without noise, from an error of 1e-4: held at the theory's last delay, and lost four strikes later."""
    last = next(strikes for strikes in range(200) if _largest_root(gain, strikes + 1) > 1.0)
    assert last >= 4
    for strikes, held in ((last, True), (last + 4, False)):
        # Answered in the middle between two strikes, so that it is clear which flight is the first to be gripped.
        drummer = Drummer((strikes - 0.5) / _roll().rate_Hz, gain, 0.0)
        assert (held_s(LITERAL, _roll(), drummer, 0, 60.0, 1e-4) == 60.0) == held


def test_a_grip_that_answers_too_little_loses_it() -> None:
    """Below the gain at which even an answer without delay leaves a root above 1."""
    assert _largest_root(2.0, 0) > 1.02
    assert held_s(LITERAL, _roll(), Drummer(0.0, 2.0, 0.0), 0, 60.0, 1e-3) < 60.0


def test_a_grip_that_is_held_still_loses_it() -> None:
    """By the multiplier: from 1 % to a quarter takes ln(25)/ln(mu) strikes; growth is not linear at the end."""
    still = Drummer(0.1, 0.0, 0.0)
    about_s = np.log(25.0) / np.log(_roll().multiplier) / _roll().rate_Hz
    for off in (0.01, -0.01):
        assert held_s(LITERAL, _roll(), still, 0, off=off) == pytest.approx(about_s, rel=0.5)


def test_a_quick_hand_holds_it_and_a_slow_one_does_not() -> None:
    assert share_held(LITERAL, _roll(), Drummer(0.1, 5.0), 10) == 1.0
    assert share_held(LITERAL, _roll(), Drummer(0.25, 5.0), 10) == 0.0
    assert share_held(LITERAL, _roll(), Drummer(0.1, 5.0, 1.0), 10) == 0.0  # a grip that is all noise


def test_the_same_seed_is_the_same_try() -> None:
    drummer = Drummer(0.16, 5.0)
    tries = [held_s(LITERAL, _roll(), drummer, seed) for seed in (1, 1, 2)]
    assert tries[0] == tries[1] != tries[2]


def test_a_scene_without_an_unstable_roll_is_refused() -> None:
    with pytest.raises(ValueError, match="no even roll that is unstable"):
        unstable_roll(parse(shipped_text("roll"), "roll"))
