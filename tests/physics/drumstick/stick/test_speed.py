"""`exact` against scipy's solve_ivp and against our own rk4: the same bounces, time and error, in one run."""

import numpy as np
import pytest

import bounces
import mp_stick
import stick_cases
from drumstick.stick.simulate import Stepper
from drumstick_lab.accuracy.sticks import solve_ivp_stick
from drumstick_lab.accuracy.sticks.contacts import largest_error

ROUNDS, MOST_ROUNDS = 6, 60
CYCLES = {row["case"]: row for row in stick_cases.rows("limit_cycles.csv")}
RK4_STEPS_S = 1e-3 / 2.0 ** np.arange(11)


@pytest.mark.parametrize("case", ["A_stick_T", "A_stick_X_force", "A_stick_L_small"])
def test_the_reference_is_the_other_reference(case: str) -> None:
    """Instants solved for again by mpmath against the stored ones, which another program computed."""
    scene = stick_cases.cycle_scene(CYCLES[case])
    stored = [
        [float(row[key]) for key in ("t_in", "v_in", "t_out", "v_out")]
        for row in stick_cases.rows("sequences.csv")
        if row["case"] == case
    ]
    found = mp_stick.contacts(scene, solve_ivp_stick.play(scene, len(stored)))
    np.testing.assert_allclose(found, stored, rtol=1e-15, atol=0)


def _times_faster(case: str, enough: float) -> float:
    # The best windows of both, about as long in turn. Where others use the machine, one of them may have had no quiet
    # moment yet: then more windows of both.
    window, ours, theirs = bounces.Window(case), np.inf, np.inf
    for taken in range(MOST_ROUNDS):
        theirs = min(theirs, bounces.scipy_window(case))
        ours = min(ours, *(window() for _ in range(8)))
        if taken + 1 >= ROUNDS and theirs / ours >= enough:
            break
    return float(theirs / ours)


@pytest.mark.parametrize("case", bounces.CASES)
def test_exact_is_a_thousand_times_faster_than_solve_ivp_and_no_less_exact(case: str) -> None:
    asked = bounces.CASES[case]
    # The thousand itself is for a quiet machine: drumstick lab stick-methods.
    assert _times_faster(case, 1000.0) >= 700.0
    assert len(bounces.contacts(case)) >= asked.bounces
    true = bounces.reference(case)
    exact = largest_error(bounces.contacts(case), true)
    assert exact <= largest_error(bounces.played_by_scipy(case).contacts, true)
    assert exact < 1e-13


@pytest.mark.parametrize("case", ["roll", "unilateral"])
def test_exact_is_faster_than_rk4_that_is_as_exact(case: str) -> None:
    """Every step of rk4 with event location either costs more or errs more; where both err by 1e-12, much more."""
    true = bounces.reference(case)
    exact = largest_error(bounces.contacts(case), true)
    exact_s = min(bounces.Window(case)() for _ in range(ROUNDS))
    first_good = None
    for dt in RK4_STEPS_S:
        stepper = Stepper("rk4", float(dt))
        wrong = largest_error(bounces.contacts(case, stepper), true)
        window = bounces.Window(case, stepper, copies=20)
        spent = min(window() for _ in range(3))
        assert wrong > exact or spent > exact_s
        if wrong <= 1e-12 and first_good is None:
            first_good = spent
    assert exact < 1e-12
    assert first_good is not None
    assert first_good > 10.0 * exact_s
