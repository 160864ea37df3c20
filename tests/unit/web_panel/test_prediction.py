"""What a set would do: asked about the rig that is shown, and put into words."""

import sys
import threading
import time
from collections.abc import Iterator

import pytest

from drumstick.parameters import table_of
from drumstick.scene import parse, shipped_text
from web_panel.computing.computer import Computer
from web_panel.computing.questions import Foreseen
from web_panel.prediction import Prediction
from web_panel.wording import foreseen_words

ROLL = parse(shipped_text("roll"), "roll.toml")
ECHO = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    print(json.dumps({"type": "foreseen", "refusal": json.dumps(asked["limits"])}), flush=True)
"""


@pytest.fixture
def prediction() -> Iterator[Prediction]:
    computer = Computer([sys.executable, "-c", ECHO])
    yield Prediction(computer)
    computer.close()


def test_it_is_about_the_rig_that_is_shown_and_its_limits(prediction: Prediction) -> None:
    prediction.ask({"dv_pls": 0.1})
    assert prediction.asked is None  # about no rig yet
    prediction.show_for(ROLL, {})
    prediction.ask({"dv_pls": 0.5})
    end = time.monotonic() + 20.0
    while prediction.newest is None:
        assert time.monotonic() < end
        time.sleep(0.005)
    assert prediction.newest == ({"dv_pls": 0.5}, Foreseen(refusal="{}"))
    prediction.show_for(ROLL, {})
    assert prediction.asked == {"dv_pls": 0.5}
    prediction.show_for(ROLL, {"max_force_N": 8.0, "max_speed_m_per_s": 3.0})
    assert (prediction.asked, prediction.newest) == (None, None)


def test_a_wish_waits_until_its_own_prediction_is_shown_and_for_none_that_is_not_near(
    prediction: Prediction,
) -> None:
    at_once, long_s = 0.0, 20.0
    prediction.show_for(ROLL, {})
    prediction.ask({"dv_pls": 0.5})
    assert not prediction.wait_until_shown(long_s)  # the first one compiles for a minute: sent without
    prediction.note_shown({"dv_pls": 0.5})
    assert prediction.wait_until_shown(at_once)
    prediction.ask({"dv_pls": 0.6})
    assert not prediction.wait_until_shown(at_once)  # what is shown is about another value
    drawn = threading.Timer(0.05, prediction.note_shown, ({"dv_pls": 0.6},))
    drawn.start()
    assert prediction.wait_until_shown(long_s)
    prediction.ask({"dv_pls": 0.7})
    gone = threading.Timer(0.05, prediction.note_shown, (None,))  # the process ended
    gone.start()
    prediction.wait_until_shown(long_s)
    assert not prediction.wait_until_shown(long_s)
    drawn.join()
    gone.join()


def test_it_is_worded_with_its_verdict() -> None:
    table = table_of(ROLL)
    forecast = foreseen_words(Foreseen("cycle", 0.628, 23.05, 0.694, 1), {"dv_pls": 0.3}, table)
    assert forecast.about == "With Δv_pls 0.3 m/s"
    assert forecast.numbers == (("roll", "23.1", "Hz"), ("v_lc", "0.63", "m/s"))
    assert forecast.verdict == "stable, a disturbance falls to a tenth in 7 strokes"
    assert "grows" in foreseen_words(Foreseen("cycle", 0.6, 23.0, -1.2, 1), {}, table).verdict
    assert "2 strokes by turns" in foreseen_words(Foreseen("cycle", 0.6, 23.0, 0.5, 2), {}, table).verdict
    assert "comes to rest" in foreseen_words(Foreseen("captured"), {}, table).verdict
    assert foreseen_words(Foreseen(refusal="too much"), {}, table).refusal == "too much"
