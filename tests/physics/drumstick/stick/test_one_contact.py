"""One contact, one flight: the coefficient of restitution, the pulse's gain, the softness of the hand."""

import math

import numpy as np
import pytest

import stick_cases
from drumstick.parameters.stick import Stick
from drumstick.stick import contact
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact

M, K_COLL = 0.015, 5000.0
BETA = stick_cases.rows("beta.csv")
MAP = stick_cases.rows("contact_map.csv")
ALPHA = stick_cases.rows("alpha.csv")
SETS = {row["set"]: row for row in stick_cases.rows("limit_cycles.csv")}


def _beta_stick(row: dict[str, str]) -> Stick:
    numbers = [float(row[key]) for key in ("m", "K_coll", "R_in", "K_hand")]
    return Stick(*numbers, 0.0, float(row["z_ss"]), stick_cases.RELEASE[row["release"]])  # pyright: ignore


@pytest.mark.parametrize("row", BETA, ids=lambda row: f"zeta {row['zeta']} {row['release']}")
def test_restitution(row: dict[str, str]) -> None:
    """Measured rebound, time and depth over the damping ratio, hand-free `paper` and hand-held `unilateral`."""
    played = stick_cases.scene(_beta_stick(row))
    found = stick_cases.until(played, float(row["v_in"]), exact.RELEASE)
    if row["beta_meas"].startswith("never leaves"):
        assert found is None
        return
    assert found is not None
    motion, _ = found
    assert motion["v_out"][0] == pytest.approx(float(row["beta_meas"]), rel=1e-9)
    assert motion["z_min"][0] == pytest.approx(float(row["z_min"]), rel=1e-9)
    until_let_go = float(row["t_contact"])
    if row["release"] == "zero":
        assert motion["contact_s"][0] == pytest.approx(until_let_go, rel=1e-9)
    else:
        for share, phase in ((1.0 - 1e-9, exact.CONTACT), (1.0 + 1e-9, exact.SEPARATED)):
            law, again = law_of(played), thrown(played, float(row["v_in"]))
            stick_cases.advance_by(law, again, until_let_go * share)
            assert again["contact_phase"][0] == phase


@pytest.mark.parametrize("row", BETA, ids=lambda row: f"zeta {row['zeta']} {row['release']}")
def test_closed_forms(row: dict[str, str]) -> None:
    """contact.py against the reference's formulas: beta by (3), beta and time of a head that only pushes."""
    stick = _beta_stick(row)
    given = (stick.m_kg, stick.k_coll_N_per_m, stick.r_in_N_s_per_m)
    assert contact.damping_ratio(*given) == pytest.approx(float(row["zeta"]), rel=1e-12)
    assert contact.beta_eq3(*given) == pytest.approx(float(row["beta_eq3"]), rel=1e-11, abs=1e-300)
    assert contact.beta_unilateral(*given) == pytest.approx(float(row["beta_closed_force"]), rel=1e-11)
    assert contact.contact_time(contact.UNILATERAL, *given) == pytest.approx(
        float(row["t_c_closed_force"]), rel=1e-11
    )
    if row["pi_over_omega_d"]:
        assert contact.contact_time(contact.PAPER, *given) == pytest.approx(
            float(row["pi_over_omega_d"]), rel=1e-11
        )


@pytest.mark.parametrize("row", BETA, ids=lambda row: f"zeta {row['zeta']} {row['release']}")
def test_peak_force_of_a_free_blow(row: dict[str, str]) -> None:
    """`peak_force` against the largest force of the exact motion, without a hand."""
    stick = Stick(M, K_COLL, float(row["R_in"]), 0.0, 0.0, 0.0, "unilateral")
    found = stick_cases.until(stick_cases.scene(stick), -1.0, exact.RELEASE)
    assert found is not None
    predicted = contact.peak_force(M, K_COLL, stick.r_in_N_s_per_m, 1.0)
    assert found[0]["peak_N"][0] == pytest.approx(predicted, rel=1e-10)
    # The head's impulse is what turned the stick round.
    assert found[0]["impulse_N_s"][0] == pytest.approx(M * (1.0 + found[0]["v_out"][0]), rel=1e-10)


@pytest.mark.parametrize(
    "row", MAP, ids=lambda row: f"zeta {row['zeta']} tau {row['tau_over_tc']} dv {row['dv_over_vin']}"
)
def test_pulse_at_entry(row: dict[str, str]) -> None:
    """v_E/v_in and contact time of one contact with a pulse up at entry, to 1e-9."""
    r_in = 2.0 * float(row["zeta"]) * math.sqrt(M * K_COLL)
    t_c = contact.contact_time(contact.PAPER, M, K_COLL, r_in)
    tau = float(row["tau_over_tc"]) * t_c
    stick = Stick(M, K_COLL, r_in, 0.0, 0.0, 0.0, "paper")
    pulse = Pulse(float(row["dv_over_vin"]), tau, "entry", 1)
    found = stick_cases.until(stick_cases.scene(stick, pulse), -1.0, exact.RELEASE)
    assert found is not None
    motion, _ = found
    v_e = motion["v_out"][0] + tau * motion["pulse"]["acceleration"][0]
    assert v_e == pytest.approx(float(row["vE_over_vin"]), rel=1e-9)
    assert motion["contact_s"][0] / t_c == pytest.approx(float(row["t_contact_over_tc"]), rel=1e-9)


@pytest.mark.parametrize("name", sorted({row["set"] for row in ALPHA}))
def test_flight(name: str) -> None:
    """Return of a flight: speed that the hand gives back, duration and height, to 1e-9."""
    numbers = [float(SETS[name][key]) for key in ("m", "K_coll", "R_in", "K_hand", "R_out", "z_ss")]
    played = stick_cases.scene(Stick(*numbers))
    flights = [row for row in ALPHA if row["set"] == name]
    computed: list[tuple[float, float, float]] = []
    for row in flights:
        found = stick_cases.until(played, float(row["v_out"]), exact.ENTRY)
        assert found is not None
        motion, t = found
        computed.append((-motion["v_in"][0] / float(row["v_out"]), t, motion["z_apex"][0]))
    expected = [[float(row[key]) for key in ("alpha", "t_flight", "z_apex")] for row in flights]
    np.testing.assert_allclose(computed, expected, rtol=1e-9)
