"""The first contacts and the settled roll of every reference case."""

import numpy as np
import pytest

import stick_cases
from drumstick.stick.simulate import COLUMNS, simulate

CYCLES = stick_cases.rows("limit_cycles.csv")
BY_REFERENCE_NAME = {
    "t_in": "t_in_s",
    "v_in": "v_in_m_per_s",
    "t_out": "t_out_s",
    "v_out": "v_out_m_per_s",
    "v_E": "v_e_m_per_s",
    "z_min": "z_min_m",
}
BY_CASE = {row["case"]: row for row in CYCLES}
SETTLING_CONTACTS = 400  # the slowest multiplier, 0.84, has then shrunk a start of 1 m/s below 1e-30
PERIODIC = [name for name, row in BY_CASE.items() if row["period_k"] == "1"]


@pytest.mark.parametrize("case", BY_CASE)
def test_first_contacts(case: str) -> None:
    """Times and speeds of the first 25 contacts, to 1e-11."""
    expected = [row for row in stick_cases.rows("sequences.csv") if row["case"] == case]
    run = simulate(stick_cases.cycle_scene(BY_CASE[case]), float(expected[-1]["t_out"]) + 1e-6)
    assert len(run.contacts) == len(expected) == 25
    for reference, ours in BY_REFERENCE_NAME.items():
        computed = run.contacts[:, COLUMNS.index(ours)]
        np.testing.assert_allclose(computed, [float(row[reference]) for row in expected], rtol=1e-11, atol=0)


@pytest.mark.parametrize("case", PERIODIC)
def test_settled_roll(case: str) -> None:
    """The roll that every start runs into: speeds, rate, contact time, deepest point, to 1e-9."""
    row = BY_CASE[case]
    rate = float(row["roll_rate_hz"])
    contacts = simulate(stick_cases.cycle_scene(row), SETTLING_CONTACTS / rate).contacts
    last = dict(zip(COLUMNS, contacts[-1], strict=True))
    assert last["v_e_m_per_s"] == pytest.approx(float(row["v_E"]), rel=1e-9)
    assert last["v_in_m_per_s"] == pytest.approx(float(row["v_in"]), rel=1e-9)
    assert last["v_out_m_per_s"] == pytest.approx(float(row["v_out"]), rel=1e-9)
    assert last["z_min_m"] == pytest.approx(float(row["z_min"]), rel=1e-9)
    assert 1.0 / (contacts[-1, 0] - contacts[-2, 0]) == pytest.approx(rate, rel=1e-9)


def test_the_pulse_of_the_paper_at_a_fifth_alternates() -> None:
    """A_stick_L_small has period 2: every other contact has the same speed, neighbours have not."""
    row = BY_CASE["A_stick_L_small"]
    v_e = simulate(stick_cases.cycle_scene(row), 10.0).contacts[-4:, COLUMNS.index("v_e_m_per_s")]
    pair = sorted((float(row["v_E"]), float(row["v_E_other_if_period2"])))
    np.testing.assert_allclose(np.sort(v_e), np.repeat(pair, 2), rtol=1e-9)
    assert v_e[0] != pytest.approx(v_e[1], rel=0.1)
