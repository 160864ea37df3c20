"""Declared order of each method, by the slope of its error over the step."""

import numpy as np
import pytest

import stick_cases
from drumstick.parameters.scene import Scene
from drumstick.stick.methods.carry import ORDERS, STEPPERS
from drumstick.stick.simulate import COLUMNS, Stepper, simulate
from stability.catalogue import shows

T_IN, V_IN = COLUMNS.index("t_in_s"), COLUMNS.index("v_in_m_per_s")
CASES = {row["case"]: row for row in stick_cases.rows("limit_cycles.csv")}
SHOWN = ("A_stick_X", "A_stick_L", "A_stick_T", "A_stick_X_force")
STEPS_S = 4e-5 / 2.0 ** np.arange(5)
CONTACTS = 6


def _error(scene: Scene, stepper: Stepper, v0: float) -> float:
    reference = simulate(scene, 0.3, v0).contacts[:CONTACTS]
    found = simulate(scene, 0.3, v0, stepper).contacts[:CONTACTS]
    assert len(found) == len(reference) == CONTACTS
    return float(np.max(np.abs(found[:, T_IN] - reference[:, T_IN])))


def _slope(errors: list[float], steps: np.ndarray) -> float:
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


@pytest.mark.parametrize("case", SHOWN)
@pytest.mark.parametrize("method", STEPPERS)
def test_with_event_location_a_method_keeps_its_declared_order(method: str, case: str) -> None:
    scene = stick_cases.cycle_scene(CASES[case])
    # The fourth order would soon be lost in rounding: longer steps show it, and less evenly, for the pulse is short.
    order = ORDERS[method]
    steps, slack = (STEPS_S, 0.25) if order < 4 else (3.2e-4 / 2.0 ** np.arange(5), 0.6)
    errors = [_error(scene, Stepper(method, dt), 0.4) for dt in steps]
    assert _slope(errors, steps) == pytest.approx(order, abs=slack)


@pytest.mark.parametrize("method", STEPPERS)
def test_without_it_every_method_is_of_order_one(method: str) -> None:
    """A contact falls anywhere in a step, by chance: the root of the mean square over many throws."""
    scene = stick_cases.cycle_scene(CASES["A_stick_X"])
    throws = np.linspace(0.35, 0.45, 24)
    errors = [
        float(np.sqrt(np.mean([_error(scene, Stepper(method, dt, locates=False), v0) ** 2 for v0 in throws])))
        for dt in STEPS_S
    ]
    assert _slope(errors, STEPS_S) == pytest.approx(1.0, abs=0.2)


@shows("contact of a few steps")
def test_at_the_same_step_location_is_worth_orders_of_magnitude() -> None:
    scene = stick_cases.cycle_scene(CASES["A_stick_X"])
    located = _error(scene, Stepper("rk4", 1e-5), 0.4)
    unlocated = _error(scene, Stepper("rk4", 1e-5, locates=False), 0.4)
    assert located < 1e-10 < 1e-6 < unlocated


@shows("contact of a few steps")
def test_a_coarse_step_without_location_gives_energy_and_located_midpoint_does_not() -> None:
    """An undamped head at half of its radian: a stick that is found deep in it has been given that spring's energy."""
    stick = stick_cases.Stick(0.015, 5000.0, 0.0, 20.0, 0.0, -0.02, "paper")
    scene = stick_cases.scene(stick)
    naive = simulate(scene, 5.0, 0.4, Stepper("implicit_midpoint", 8e-4, locates=False)).contacts
    held = simulate(scene, 5.0, 0.4, Stepper("implicit_midpoint", 8e-4)).contacts
    v_out = COLUMNS.index("v_out_m_per_s")
    assert np.max(naive[:, v_out]) > 0.5
    assert np.max(held[:, v_out]) <= 0.4 * (1.0 + 1e-9)
