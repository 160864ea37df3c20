"""The contact law of a mallet's tip: its one solution, and that no step of it makes energy."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.optimize import brentq

from drumstick.drum.mallets.tip import advance_tip, elastic_force, reset_tip, solve_contact
from mallets import struck_at_random, tip_of

DEPTHS = st.floats(-1e-3, 1e-3)
# Float64's rounding of where the tip is, times its push: the farther from 0 the head is, to a slow mallet's way in a
# step, the more. The most was 1.5e-12 of a million strikes, 3.3e-11 of ten million.
ROUNDING = 1e-10


def _energy(k: float, p: float, depth: float) -> float:
    return k * max(depth, 0.0) ** (p + 1.0) / (p + 1.0)


def _force(k: float, p: float, rate: float, before: float, now: float, after: float) -> float:
    """From its definition."""
    if after == before:
        return k * max(after, 0.0) ** p
    gradient = (_energy(k, p, after) - _energy(k, p, before)) / (after - before)
    return max(0.0, gradient + rate * k * max(now, 0.0) ** p * (after - before))


@given(
    st.floats(1.0, 4.0),
    st.floats(3.0, 10.0),
    st.floats(0.0, 1e4),
    st.floats(-9.0, -3.0),
    DEPTHS,
    DEPTHS,
    DEPTHS,
)
@example(1.5, 7.0, 0.0, -5.0, 0.0, 0.0, 1e-4)
@example(1.0, 3.0, 0.0, -9.0, -5e-324, 0.0, 1e-9)
@example(2.0, 8.0, 1e3, -4.0, 1e-4, 2e-4, -1e-4)
@example(
    1.0, 9.0, 0.0, -3.0, 8.870149547577121e-4, 0.0, 0.0
)  # far: as stiff as a million times what it meets
def test_the_meeting_solves_its_equation_and_makes_no_energy(
    p: float, log_k: float, rate: float, log_compliance: float, before: float, now: float, free: float
) -> None:
    k, compliance = 10.0**log_k, 10.0**log_compliance
    tip = tip_of(k, p, 0.0, 1.0, compliance)
    tip["loss_rate"] = rate
    reset_tip(tip, 0.0, 0.0)
    advance_tip(tip, before)
    advance_tip(tip, now)
    after, force = solve_contact(tip, free)

    def wrong(depth: float) -> float:
        return depth + compliance * _force(k, p, rate, before, now, depth) - free

    far = abs(before) + abs(now) + abs(free) + 1e-6
    low = -far
    while wrong(low) > 0.0:
        low *= 2.0
    assert after == pytest.approx(brentq(wrong, low, free + far, xtol=1e-16), abs=1e-6 * (far - low))
    assert force >= 0.0
    stored = _energy(k, p, after) - _energy(k, p, before)
    # Both are known to the last digit of where the tip is: of the energy that moves it through so far in a step.
    rounding = 4e-16 * ((far - low) ** 2 / compliance + _energy(k, p, after) + _energy(k, p, before))
    assert force * (after - before) >= stored - rounding


@given(st.integers(2, 8), st.floats(1e-9, 1e-1))
def test_products_and_a_root_are_the_power(twice_exponent: int, depth: float) -> None:
    quick, plain = (
        tip_of(3.0, 0.5 * twice_exponent, 0.0, 1.0, 1.0),
        tip_of(3.0, 0.5 * twice_exponent, 0.0, 1.0, 1.0),
    )
    plain["twice_exponent"] = 0
    assert elastic_force(quick, depth) == pytest.approx(elastic_force(plain, depth), rel=1e-14)
    assert elastic_force(quick, -depth) == 0.0


def test_apart_stays_apart() -> None:
    tip = tip_of(1e8, 1.5, 0.3, 1e-4, 1e-5)
    reset_tip(tip, -2e-3, -3e-3)
    assert solve_contact(tip, -1e-3) == (-1e-3, 0.0)


def _at_random(strikes: int, seed: int) -> None:
    tips = np.array([tip_of(1.0, 1.5, 0.0, 1.0, 1.0)])
    worst, moved, touches, pressed = struck_at_random(tips, strikes, seed)
    assert worst < ROUNDING
    assert moved > 0.5, "the loss takes"
    assert touches > 1.2 * strikes, "they chatter"
    assert pressed > 0.1 * strikes, "some begin while the last one is pressed in"
    assert math.isfinite(worst)


def test_no_step_of_any_of_a_hundred_thousand_strikes_makes_energy() -> None:
    _at_random(100_000, 1)


@pytest.mark.long
@pytest.mark.timeout(1200)
def test_no_step_of_any_of_ten_million_strikes_makes_energy() -> None:
    _at_random(10_000_000, 2)
