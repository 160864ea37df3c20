"""`exact` against scipy's solve_ivp and against our own rk4: the same bounces, and the error of each."""

import numpy as np
import pytest

import bounces
import mp_stick
import stick_cases
from drumstick.stick.simulate import Stepper
from drumstick_lab.accuracy.sticks import solve_ivp_stick
from drumstick_lab.accuracy.sticks.contacts import largest_error

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


@pytest.mark.parametrize("case", bounces.CASES)
def test_exact_is_no_less_exact_than_solve_ivp(case: str) -> None:
    """Speed beside the others: see `drumstick lab stick-methods`."""
    true = bounces.reference(case)
    assert len(bounces.contacts(case)) >= bounces.CASES[case].bounces
    exact = largest_error(bounces.contacts(case), true)
    assert exact <= largest_error(bounces.played_by_scipy(case).contacts, true)
    assert exact < 1e-13


@pytest.mark.parametrize("case", ["roll", "unilateral"])
def test_rk4_comes_as_near_with_short_steps_only(case: str) -> None:
    true = bounces.reference(case)
    wrong = [largest_error(bounces.contacts(case, Stepper("rk4", float(dt))), true) for dt in RK4_STEPS_S]
    assert wrong[0] > 1e3 * largest_error(bounces.contacts(case), true)
    assert min(wrong) <= 1e-12
