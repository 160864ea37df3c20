"""Prediction of a set: the same as the analysis finds."""

import dataclasses

import pytest

from drumstick.analysis.findings import analyse
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
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


@pytest.mark.parametrize("scene", ["roll", "paper-roll"])
def test_the_ends_of_what_is_accepted_are_where_the_envelope_begins_to_refuse(scene: str) -> None:
    played = parse(shipped_text(scene), scene)
    table = table_of(played)
    found = predicted_roll(played, {}, {}).open
    assert "dv_pls" in found
    for name, (low, high) in found.items():
        q = table[name].quantity
        for end, beyond in (
            (low, max(q.low, low - 0.01 * abs(low) - 0.001 * (q.high - q.low))),
            (high, min(q.high, 1.01 * high + 0.001 * (q.high - q.low))),
        ):
            assert predicted_roll(played, {name: end}, {}).refusal == "", name
            if end not in (q.low, q.high):
                assert predicted_roll(played, {name: beyond}, {}).refusal, name
    assert predicted_roll(played, {"dv_pls": 9.0}, {}).open == {}


def test_a_roll_that_dies_and_a_scene_that_never_repeats() -> None:
    assert predicted_roll(ROLL, {"dv_pls": 0.0}, {}).end == "captured"
    assert predicted_roll(parse(shipped_text("rejected-by-the-paper"), "wild.toml"), {}, {}).end == "endless"
