"""Stick's part of `drumstick accuracy`: its truth, its peer, and errors that are those of the method."""

import numpy as np
import pytest

import bounces
import stick_cases
from drumstick.stick.simulate import Stepper
from drumstick_lab.accuracy.stick import EXACT_ERROR, SCENE, Roll
from drumstick_lab.accuracy.sticks.contacts import Errors, cycle_of

REFERENCE = next(row for row in stick_cases.rows("limit_cycles.csv") if row["case"] == "A_stick_X")


@pytest.fixture(scope="module")
def roll() -> Roll:
    return Roll()


def test_each_error_that_is_told_falls_as_the_method_does(roll: Roll) -> None:
    """A fifth of the step: verlet's are a 25th. The orders of all: tests/physics/drumstick/stick/test_orders.py."""
    coarse, fine = (np.array(roll.errors_of(Stepper("verlet", dt_s))) for dt_s in (1e-4, 2e-5))
    assert coarse / fine == pytest.approx(np.full(3, 25.0), rel=0.05)


def test_the_truth_is_the_cycle_of_the_40_digit_reference(roll: Roll) -> None:
    cycle = cycle_of(roll.truth)
    assert cycle is not None
    wanted = [float(REFERENCE[key]) for key in ("v_E", "roll_rate_hz")]
    np.testing.assert_allclose(cycle, wanted, rtol=1e-13, atol=0.0)


def test_exact_errs_by_no_more_than_is_told() -> None:
    """Over 100 contacts against 40 digits; and the bound is not a loose one."""
    wrong = bounces.error_after(SCENE, 100)
    assert EXACT_ERROR / 10.0 < wrong <= EXACT_ERROR


def test_the_peer_comes_as_near_as_it_is_asked(roll: Roll) -> None:
    tolerances = (1e-4, 1e-7, 1e-10)
    found = [roll.errors_of_peer(rtol) for rtol in tolerances]
    for rtol, errors in zip(tolerances, found, strict=True):
        assert max(error for error in errors if error is not None) < 100.0 * rtol
        assert None not in errors


def test_a_roll_that_dies_or_grows_has_no_cycle(roll: Roll) -> None:
    assert roll.errors_of(Stepper("verlet", 0.01)) == Errors(None, None, None)
    grown = roll.errors_of(Stepper("semi_implicit_euler", 0.005, locates=False))
    assert grown.v_lc is grown.rate is None
