"""Prediction of a set: the same as the analysis finds."""

import dataclasses

import pytest

from drumstick.analysis.findings import analyse
from drumstick.scenes.scene_text import parse, shipped_text
from web_panel.computing.computing_messages import PredictedRoll
from web_panel.computing.predicted_roll import predicted_roll

ROLL = parse(shipped_text("roll"), "roll.toml")


def test_it_is_what_the_analysis_finds_for_a_scene_with_these_values() -> None:
    pulse = dataclasses.replace(ROLL.effects["pulse"], dv_m_per_s=0.3)
    found = analyse(dataclasses.replace(ROLL, effects={"pulse": pulse}))
    assert found.primary is not None
    cycle = found.cycles[found.primary]
    seen = predicted_roll(ROLL, {"dv_pls": 0.3}, {})
    assert (seen.end, seen.period, seen.refusal) == ("cycle", cycle.period, "")
    assert (seen.v_lc_m_per_s, seen.rate_Hz, seen.multiplier) == pytest.approx(
        (cycle.v_e_m_per_s, cycle.rate_Hz, cycle.multiplier), rel=1e-9
    )


def test_what_the_envelope_would_refuse_is_said_beside_what_would_happen() -> None:
    seen = predicted_roll(ROLL, {"dv_pls": 9.0}, {})
    assert "the limit is" in seen.refusal
    assert seen.rate_Hz is not None
    tight = predicted_roll(ROLL, {}, {"max_force_N": 0.1, "max_speed_m_per_s": 10.0})
    assert "the limit is 0.1 N" in tight.refusal
    assert predicted_roll(ROLL, {"dv_pls": 11.0}, {}) == PredictedRoll(
        refusal="dv_pls: 11 m/s is outside 0 .. 10 m/s"
    )


def test_a_roll_that_dies_and_a_scene_that_never_repeats() -> None:
    assert predicted_roll(ROLL, {"dv_pls": 0.0}, {}).end == "captured"
    assert predicted_roll(parse(shipped_text("rejected-by-the-paper"), "wild.toml"), {}, {}).end == "endless"
