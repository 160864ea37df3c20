"""Sweeps over parameters: each point is what a plain simulation of that scene does."""

import numpy as np
import pytest

import stick_cases
from drumstick.analysis.cycles.sweep import (
    BUZZ_HZ,
    BUZZING,
    CAPTURED,
    LEFT,
    MEASURED,
    STABLE,
    Axis,
    Swept,
    sweep,
)
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.scenes.table import Refusal, table_of, values_of
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of
from drumstick.stick.simulate import COLUMNS, simulate

A = stick_cases.STICK_A
EXIT = stick_cases.scene(A, Pulse(0.2, 0.002, "exit", 1))
ENTRY = stick_cases.scene(A, Pulse(0.2, 0.002, "entry", 1))
V_E = COLUMNS.index("v_e_m_per_s")


def _all(scene: Scene, *axes: Axis, settle: int = 400, chunk: int = 64) -> Swept:
    swept = None
    for swept in sweep(scene, axes, settle, chunk):
        assert swept.done <= swept.total
    assert swept is not None
    assert swept.done == swept.total
    return swept


def test_each_point_is_the_plain_simulation_of_it() -> None:
    dvs = np.array([0.05, 0.2, 0.6, 1.0])
    swept = _all(ENTRY, Axis("dv_pls", dvs))
    assert swept.kind.shape == (4,)
    assert swept.v_e_m_per_s.shape == (4, MEASURED)
    for i, dv in enumerate(dvs):
        run = simulate(stick_cases.scene(A, Pulse(float(dv), 0.002, "entry", 1)), 40.0, 0.4)
        if swept.kind[i] == CAPTURED:
            assert run.end == "captured"
            assert np.isnan(swept.v_e_m_per_s[i]).all()
            assert np.isnan(swept.rate_Hz[i])
        else:
            np.testing.assert_allclose(
                np.sort(swept.v_e_m_per_s[i])[-4:], np.sort(run.contacts[-64:, V_E])[-4:], rtol=1e-9
            )
    assert list(swept.kind) == [CAPTURED, BUZZING, STABLE, STABLE]
    assert list(swept.period) == [0, 2, 1, 1]


def test_the_reference_cases_are_points_of_sweeps() -> None:
    small = next(r for r in stick_cases.rows("limit_cycles.csv") if r["case"] == "A_stick_L_small")
    swept = _all(ENTRY, Axis("dv_pls", np.array([0.2])))
    assert swept.rate_Hz[0] == pytest.approx(float(small["roll_rate_hz"]), rel=1e-9)
    assert swept.v_e_m_per_s[0].max() == pytest.approx(float(small["v_E"]), rel=1e-9)
    assert swept.v_e_m_per_s[0].min() == pytest.approx(float(small["v_E_other_if_period2"]), rel=1e-9)


def test_points_do_not_depend_on_how_they_are_shared_out() -> None:
    axes = (Axis("dv_pls", np.linspace(0.0, 0.6, 7)), Axis("k_hand", np.array([8.0, 20.0, 60.0])))
    one_by_one, together = _all(EXIT, *axes, chunk=1), _all(EXIT, *axes, chunk=1000)
    assert together.kind.shape == (7, 3)
    np.testing.assert_array_equal(one_by_one.kind, together.kind)
    np.testing.assert_array_equal(one_by_one.v_e_m_per_s, together.v_e_m_per_s)
    np.testing.assert_array_equal(one_by_one.rate_Hz, together.rate_Hz)


def test_progress_is_told_and_grows() -> None:
    told = [(s.done, s.total) for s in sweep(EXIT, [Axis("dv_pls", np.linspace(0.1, 0.5, 10))], 10, 4)]
    assert told == [(4, 10), (8, 10), (10, 10)]


def test_a_lower_and_a_firmer_hand_make_a_faster_roll() -> None:
    """Section 6 of the paper, by the hand's own numbers."""
    z_h0 = values_of(law_of(EXIT), table_of(EXIT))["z_h0"]
    lower = _all(EXIT, Axis("z_h0", z_h0 + np.array([0.004, 0.0, -0.004])))
    firmer = _all(EXIT, Axis("k_hand", np.array([12.0, 20.0, 30.0])))
    for swept in (lower, firmer):
        assert list(swept.kind) == [STABLE] * 3
        assert (np.diff(swept.rate_Hz) > 1.0).all()
    assert lower.rate_Hz[1] == pytest.approx(firmer.rate_Hz[1], rel=1e-12)


def test_a_stick_that_is_taken_away_and_one_that_is_too_quick() -> None:
    away = _all(EXIT, Axis("z_ss", np.array([0.05])))
    assert away.kind[0] == LEFT
    # A fifteenth of the mass: every contact like the last, but nobody hears strokes any more.
    light = stick_cases.scene(Stick(1e-3, 5000.0, 0.1, 50.0, 0.02, -0.01, "paper"), Pulse(0.1, 1e-4))
    quick = _all(light, Axis("dv_pls", np.array([0.1])))
    assert quick.rate_Hz[0] > BUZZ_HZ
    assert quick.period[0] == 1
    assert quick.kind[0] == BUZZING


def test_a_value_out_of_range_is_refused_before_anything_runs() -> None:
    for axis in (Axis("tau", np.array([2.0])), Axis("gamma", np.array([0.1]))):
        with pytest.raises(Refusal):
            next(sweep(EXIT, [axis]))
