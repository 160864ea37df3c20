"""A roll over half a day of its own time stays where it was: no drift, no growth."""

import numpy as np
import pytest

import stick_cases
from drumstick.stick.simulate import COLUMNS, Stepper, simulate
from stability.catalogue import shows

ROW = next(row for row in stick_cases.rows("limit_cycles.csv") if row["case"] == "A_stick_X")


@shows("roll of a million contacts")
def test_a_million_contacts_do_not_drift() -> None:
    """Steps of 1 ms play another roll, by a tenth slower; of 0.1 ms one that is off in the second digit, and uneven."""
    rate = float(ROW["roll_rate_hz"])
    for dt_s, least in ((1e-3, 0.1), (1e-4, 0.01)):
        stepper = Stepper("semi_implicit_euler", dt_s, locates=False)
        naive = simulate(stick_cases.cycle_scene(ROW), 60.0, stepper=stepper).contacts[100:]
        naive_rate = (len(naive) - 1) / (naive[-1, 0] - naive[0, 0])
        assert abs(naive_rate / rate - 1.0) > least
        assert np.std(naive[:, COLUMNS.index("v_e_m_per_s")]) > 1e-3
    contacts = simulate(stick_cases.cycle_scene(ROW), 1_000_100 / rate).contacts
    assert len(contacts) >= 1_000_000
    settled = contacts[1000:]
    v_e = settled[:, COLUMNS.index("v_e_m_per_s")]
    assert float(v_e.min()) == pytest.approx(float(ROW["v_E"]), rel=1e-14)
    assert float(v_e.max()) == pytest.approx(float(ROW["v_E"]), rel=1e-14)
    t = settled[:, COLUMNS.index("t_in_s")]
    measured = (len(t) - 1) / (t[-1] - t[0])
    # Half a unit in the last place of 43,000 s, always rounded the same way, would be 5e-11 of a period: the run's
    # clock keeps what its additions lose. What is left are the last places of the period itself.
    assert measured == pytest.approx(rate, rel=1e-14)
    late = t - (t[0] + np.arange(len(t), dtype=np.longdouble) / np.longdouble(ROW["roll_rate_hz"]))
    assert float(np.max(np.abs(late))) < 1e-14 * t[-1]  # at no time in between either
