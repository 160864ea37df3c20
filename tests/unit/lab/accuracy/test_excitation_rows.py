"""Excitation of the drum: the truth is the contact law's, a stream keeps its impulse, more ticks are truer."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drumstick.stick.law import law_of
from drumstick_lab.accuracy import excitation
from drumstick_lab.accuracy.drums import blows, wire_cost

KEYS = {
    "kind", "rate_Hz", "force_error_dB", "sound_error_dB", "latency_ms",
    "bytes_per_strike", "ns_per_strike", "ratio", "magnitude_error_dB",
}  # fmt: skip


@pytest.fixture
def found(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Two rates, one place between ticks, one round."""
    monkeypatch.setattr(excitation, "RATES_HZ", (500.0, 4000.0))
    monkeypatch.setattr(excitation, "_QUICK_PLACES", 1)
    monkeypatch.setattr(excitation, "_QUICK_ROUNDS", 1)
    result: dict[str, Any] = {}
    for job in excitation.jobs(True, result):
        job.run()
    return result


@pytest.mark.long
def test_rows_are_complete_and_json(found: dict[str, Any]) -> None:
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert all(set(row) == KEYS for row in found["rows"])
    strike, slow, quick = found["rows"]
    assert [row["kind"] for row in found["rows"]] == ["analytic", "streamed", "streamed"]
    assert strike["rate_Hz"] is None
    assert strike["bytes_per_strike"] < slow["bytes_per_strike"] < quick["bytes_per_strike"]
    assert strike["latency_ms"] == pytest.approx(0.5 + 64 / 48.0)
    assert slow["latency_ms"] == quick["latency_ms"] == pytest.approx(6.0 + 128 / 48.0, abs=1e-3)
    assert quick["force_error_dB"] < slow["force_error_dB"] - 6.0
    assert strike["sound_error_dB"] < -25.0
    for error in ("sound_error_dB", "magnitude_error_dB"):
        assert quick[error] < slow[error] - 6.0  # in one band: the slow servo knows a quarter of it
    assert found["band_Hz"] == excitation.BAND_Hz


def test_the_truth_is_the_contact_of_the_equation_of_motion() -> None:
    """m z'' = -(K + K_hand) z - R_in z' + K_hand z_ss, by another program; the last pulse is long over."""
    law = law_of(blows.scene(False))[0]
    m, k, r, k_hand, r_out, z_ss = (float(law[n]) for n in ("m", "k_coll", "r_in", "k_hand", "r_out", "z_ss"))
    contact = blows.roll()

    def motion(_: float, y: Any) -> tuple[float, float, float]:
        push = -k * y[0] - (r - r_out) * y[1]
        return y[1], (push - r_out * y[1] + k_hand * (z_ss - y[0])) / m, push

    t = np.linspace(0.0, contact.t_s[-1], 20)
    solved = solve_ivp(
        motion, (0.0, t[-1]), (0.0, -contact.speed_m_per_s, 0.0), t_eval=t, rtol=1e-10, atol=1e-14
    )
    assert blows.true_impulse()(t) == pytest.approx(solved.y[2], abs=1e-6)


@pytest.mark.parametrize("rate_Hz", [500.0, 1000.0, 4000.0])
@pytest.mark.parametrize("place", [0.0, 0.3, 0.9])
def test_every_way_keeps_its_impulse(rate_Hz: float, place: float) -> None:
    forces = blows.forces_at(place, rate_Hz)
    step_s = 3.0 / 48_000.0
    whole = float(blows.true_impulse()(np.array([1.0]))[0])
    assert forces.true.sum() * step_s == pytest.approx(whole, rel=1e-9)
    assert forces.streamed.sum() * step_s == pytest.approx(whole, rel=1e-5)
    assert forces.message.sum() * step_s == pytest.approx(whole, rel=1e-9)


def test_a_finer_stream_is_the_truth() -> None:
    """At 48 kHz what is left is the jump at the beginning of a damped contact."""
    forces = blows.forces_at(0.5, 48_000.0)
    assert np.linalg.norm(forces.streamed - forces.true) < 0.02 * np.linalg.norm(forces.true)


def test_what_is_passed_on_is_played() -> None:
    assert wire_cost.analytic()() > 0.0
    assert wire_cost.streamed(1000.0)() > 0.0
