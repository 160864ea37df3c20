"""Prediction of a set: asked about the rig that is shown, and put into words."""

import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback
from web_panel.computing.computer import Computer
from web_panel.computing.computing_messages import PredictedRoll, Trouble
from web_panel.page.wording import prediction_words
from web_panel.rig.answer import Answer
from web_panel.rig.set_request import SetRequest
from web_panel.tuning.changes import Changes
from web_panel.tuning.prediction import Prediction
from web_panel.tuning.undo_file import UndoFile

ROLL = parse(shipped_text("roll"), "roll.toml")
ECHO = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    print(json.dumps({"type": "predicted_roll", "refusal": json.dumps(asked["limits"])}), flush=True)
"""


@pytest.fixture
def computer() -> Iterator[Computer]:
    started = Computer([sys.executable, "-c", ECHO])
    yield started
    started.close()


@pytest.fixture
def prediction(computer: Computer) -> Prediction:
    return Prediction(computer)


def test_it_is_about_the_rig_that_is_shown_and_its_limits(prediction: Prediction) -> None:
    prediction.ask({"dv_pls": 0.1})
    assert prediction.asked is None  # about no rig yet
    prediction.show_for(ROLL, {})
    prediction.ask({"dv_pls": 0.5})
    end = time.monotonic() + 60.0
    while prediction.newest is None:
        assert time.monotonic() < end
        time.sleep(0.005)
    assert prediction.newest == ({"dv_pls": 0.5}, PredictedRoll(refusal="{}"))
    prediction.show_for(ROLL, {})
    assert prediction.asked == {"dv_pls": 0.5}
    prediction.show_for(ROLL, {"max_force_N": 8.0, "max_speed_m_per_s": 3.0})
    assert (prediction.asked, prediction.newest) == (None, None)


def test_a_question_whose_process_ended_is_asked_again(tmp_path: Path) -> None:
    begun = tmp_path / "begun"
    first_ends = (
        f"import pathlib; it = pathlib.Path({str(begun)!r}); was = it.exists(); it.touch(); was or exit()\n"
    )
    computer = Computer([sys.executable, "-c", first_ends + ECHO])
    try:
        prediction = Prediction(computer)
        prediction.show_for(ROLL, {})
        prediction.ask({"dv_pls": 0.5})
        end = time.monotonic() + 60.0
        while prediction.newest is None or isinstance(prediction.newest.answer, Trouble):
            assert time.monotonic() < end
            prediction.ask_again()
            time.sleep(0.005)
        assert prediction.newest == ({"dv_pls": 0.5}, PredictedRoll(refusal="{}"))
    finally:
        computer.close()


def test_a_set_is_sent_while_its_prediction_is_still_computed(tmp_path: Path) -> None:
    """A process that never answers: the value goes to the rig all the same."""
    silent = Computer([sys.executable, "-c", "import sys; sys.stdin.read()"])
    prediction = Prediction(silent)
    prediction.show_for(ROLL, {})
    sent = threading.Event()

    def set_(request: SetRequest) -> Answer:
        sent.set()
        return Answer({name: Readback(value=value, revision=1) for name, value in request.values.items()})

    changes = Changes(
        set_, lambda _name, _lease: Answer(), lambda _client: "", prediction.ask, UndoFile(tmp_path / "kept")
    )
    changes.start()
    try:
        changes.want_one("dv_pls", 0.3, None)
        assert sent.wait(60.0)
        assert silent.busy
    finally:
        changes.close()
        silent.close()


def test_it_is_worded_with_its_verdict() -> None:
    table = table_of(ROLL)
    forecast = prediction_words(PredictedRoll("cycle", 0.628, 23.05, 0.694, 1), {"dv_pls": 0.3}, table)
    assert forecast.about == "Predicted with Δv_pls 0.3 m/s"
    assert forecast.numbers == (("roll", "23.1", "Hz"), ("v_lc", "0.63", "m/s"))
    assert forecast.verdict == "stable, recovers in 7 strokes"
    assert "grows" in prediction_words(PredictedRoll("cycle", 0.6, 23.0, -1.2, 1), {}, table).verdict
    assert (
        "2 strokes by turns" in prediction_words(PredictedRoll("cycle", 0.6, 23.0, 0.5, 2), {}, table).verdict
    )
    assert "comes to rest" in prediction_words(PredictedRoll("captured"), {}, table).verdict
    assert prediction_words(PredictedRoll(refusal="too much"), {}, table).refusal == "too much"
