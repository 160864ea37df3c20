"""A roll over half a day of its own time stays where it was: no drift, no growth."""

import pytest

import stick_cases
from drumstick.simulate import COLUMNS, simulate

ROW = next(row for row in stick_cases.rows("limit_cycles.csv") if row["case"] == "A_stick_X")


@pytest.mark.slow
def test_a_million_contacts_do_not_drift() -> None:
    rate = float(ROW["roll_rate_hz"])
    contacts = simulate(stick_cases.cycle_scene(ROW), 1_000_100 / rate).contacts
    assert len(contacts) >= 1_000_000
    settled = contacts[1000:]
    v_e = settled[:, COLUMNS.index("v_e_m_per_s")]
    assert float(v_e.min()) == pytest.approx(float(ROW["v_E"]), rel=1e-13)
    assert float(v_e.max()) == pytest.approx(float(ROW["v_E"]), rel=1e-13)
    measured = (len(settled) - 1) / (settled[-1, 0] - settled[0, 0])
    # Half a unit in the last place of 43,000 s, always rounded the same way, is 5e-11 of a period.
    assert measured == pytest.approx(rate, rel=1e-10)
