"""The servo's part of `drumstick accuracy`: every row has every key, and JSON can tell it."""

import json
from itertools import groupby, product
from typing import Any

import pytest

from drumstick_lab.accuracy import servo
from drumstick_lab.accuracy.servo import Case
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE, FILTERS

KEYS = {
    "k_coll", "rate_Hz", "delay_ticks", "predictor", "filter", "restitution", "design", "theory", "energy",
    "guarded_most", "passes_envelope", "ticks_in_contact", "tick_ns", "share_of_core", "ratio", "missed",
}  # fmt: skip
FEW = (Case(1000, 0, 500.0), Case(1000, 1, 3500.0))
FILTERED = (ADAPTIVE, "low-pass 20 Hz")


@pytest.fixture
def tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two cases, one round: this is not about the figures."""
    for name, value in {"QUICK": FEW, "QUICK_FILTERS": FILTERED, "ROUNDS": 1}.items():
        monkeypatch.setattr(servo, name, value)


def _found() -> dict[str, Any]:
    found: dict[str, Any] = {}
    for job in servo.jobs(True, found):
        assert job.words.startswith("servo: ")
        job.run()
    return json.loads(json.dumps(found, allow_nan=False))


@pytest.mark.usefixtures("tiny")
def test_a_row_for_each_device_and_filter() -> None:
    found = _found()
    assert set(found) == {"design", "rows", "yardstick_ns"}
    assert found["design"] == {"m_kg": 0.075, "r_in": 2.5, "speed_m_per_s": 0.3}
    told = [
        (row["rate_Hz"], row["delay_ticks"], row["k_coll"], row["predictor"], row["filter"])
        for row in found["rows"]
    ]
    assert told == [(*case, led, kind) for case, led, kind in product(FEW, ("off", "lead"), FILTERED)]
    for row in found["rows"]:
        assert set(row) == KEYS
        given = row["restitution"]
        assert 0.0 < given["least"] <= given["mean"] <= given["most"]
        # The mean of the squares, which is more than the mean's square.
        mean, most = given["mean"] ** 2 - row["design"] ** 2, given["most"] ** 2 - row["design"] ** 2
        assert mean < row["energy"] < min(most, mean + 0.01)
        assert row["share_of_core"] == pytest.approx(row["tick_ns"] * 1e-9 * row["rate_Hz"])
        assert not row["missed"]


@pytest.mark.usefixtures("tiny")
def test_theory_is_of_the_lag_that_is_left() -> None:
    """With the prediction none is; 3500 N/m a tick late without it is a negative R_eff, which has no restitution."""
    rows = {(row["k_coll"], row["predictor"]): row for row in _found()["rows"]}
    soft, hard = rows[500.0, "off"], rows[3500.0, "off"]
    assert soft["design"] < soft["theory"] < 1.0
    assert hard["theory"] is None
    assert (soft["passes_envelope"], hard["passes_envelope"]) == (True, False)
    for k_coll in (500.0, 3500.0):
        assert rows[k_coll, "lead"]["theory"] == rows[k_coll, "lead"]["design"]


@pytest.mark.usefixtures("tiny")
def test_an_arm_that_does_not_come_back_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(falling, "rebounds", lambda *_: [0.5, -1.0])  # pyright: ignore[reportUnknownLambdaType]
    for row in _found()["rows"]:
        assert row["missed"]
        assert row["restitution"] == {"mean": None, "least": None, "most": None}
        assert row["energy"] is row["guarded_most"] is None


def test_quick_cases_are_of_the_full_ones_and_stand_together() -> None:
    assert set(servo.QUICK) <= set(servo.FULL)
    assert set(servo.QUICK_FILTERS) <= set(FILTERS)
    for cases in (servo.QUICK, servo.FULL):
        assert len(set(cases)) == len(cases)
        groups = [key for key, _ in groupby(cases, key=lambda case: case[:2])]
        assert len(set(groups)) == len(groups)
