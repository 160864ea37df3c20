"""What a set would do: asked about the rig that is shown, and put into words."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import SimpleNamespace
from typing import cast

import pytest
import viser

from drumstick.parameters.scene import parse, shipped_text
from drumstick.parameters.table import table_of
from protocol.messages import Readback
from web_panel.computing.computer import Computer
from web_panel.computing.questions import Foreseen
from web_panel.controls.foresight import Foresight
from web_panel.page.wording import foreseen_words
from web_panel.rig.mirror import Mirror
from web_panel.tuning.prediction import Prediction

ROLL = parse(shipped_text("roll"), "roll.toml")
ECHO = """
import json, sys
for line in sys.stdin:
    asked = json.loads(line)
    print(json.dumps({"type": "foreseen", "refusal": json.dumps(asked["limits"])}), flush=True)
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
    end = time.monotonic() + 20.0
    while prediction.newest is None:
        assert time.monotonic() < end
        time.sleep(0.005)
    assert prediction.newest == (2, {"dv_pls": 0.5}, Foreseen(refusal="{}"))
    prediction.show_for(ROLL, {})
    assert prediction.asked == {"dv_pls": 0.5}
    prediction.show_for(ROLL, {"max_force_N": 8.0, "max_speed_m_per_s": 3.0})
    assert (prediction.asked, prediction.newest) == (None, None)


# Far more than a test may take: whoever waits for what never comes fails by the test's own limit.
LONG_S = 10_000.0


def meanwhile(act: Callable[[], object]) -> threading.Thread:
    thread = threading.Thread(target=act)
    thread.start()
    return thread


def test_a_wish_waits_until_its_prediction_or_a_newer_one_is_shown(computer: Computer) -> None:
    prediction = Prediction(computer, LONG_S)
    prediction.show_for(ROLL, {})
    first = prediction.ask({"dv_pls": 0.5})
    assert not first()  # nothing was shown yet, and the first one compiles for a minute: it does not wait
    prediction.note_shown(1)
    assert first()
    second, third = prediction.ask({"dv_pls": 0.6}), prediction.ask({"k_coll": 3000.0})
    drawn = meanwhile(lambda: prediction.note_shown(2))
    assert second()
    drawn.join()
    drawn = meanwhile(lambda: prediction.note_shown(5))  # another browser asked on
    assert third()
    drawn.join()
    fourth = prediction.ask({"dv_pls": 0.7})
    fifth, sixth = prediction.ask({"dv_pls": 0.8}), prediction.ask({"dv_pls": 0.9})
    assert fourth()
    assert fifth()
    gone = meanwhile(lambda: prediction.note_shown(0))  # the process ended
    assert not sixth()
    gone.join()


def test_patience_is_counted_from_the_wish_and_not_from_its_turn(computer: Computer) -> None:
    now = [0.0]
    prediction = Prediction(computer, LONG_S, lambda: now[0])
    prediction.show_for(ROLL, {})
    prediction.note_shown(1)
    waits = [prediction.ask({"dv_pls": 0.01 * i}) for i in range(2, 30)]
    now[0] = LONG_S
    assert [wait() for wait in waits[1:]] == [False] * 27  # none waits any more, or this would take days


class Handle:
    """A piece of the page: what it showed, in turn."""

    def __init__(self, did: list[str]) -> None:
        self._did = did

    @property
    def content(self) -> str:
        return self._did[-1]

    @content.setter
    def content(self, content: str) -> None:
        self._did.append(content)


def test_an_answer_is_handed_to_the_pages_before_its_wish_may_go(computer: Computer) -> None:
    """The whole way, but for the browser: asked, answered, told, written, sent off, and only then noted."""
    told = threading.Event()
    did: list[str] = []
    server = SimpleNamespace(
        gui=SimpleNamespace(add_html=lambda *_, **__: Handle(did)), flush=lambda: did.append("flush")
    )
    answering = Computer([sys.executable, "-c", ECHO], told.set)
    try:
        prediction = Prediction(answering, LONG_S)
        foresight = Foresight(cast(viser.ViserServer, server), prediction, 1.0)
        mirror = Mirror()
        mirror.note_scene(ROLL, table_of(ROLL))
        mirror.note_readback("dv_pls", Readback(value=0.2, revision=1))
        foresight.show(mirror, True, time.monotonic())
        assert told.wait(20.0)
        told.clear()
        foresight.show(mirror, True, time.monotonic())
        before = len(did)
        wait = prediction.ask({"dv_pls": 0.3})
        gone = threading.Thread(target=lambda: (wait(), did.append("sent")))
        gone.start()
        assert told.wait(20.0)
        foresight.show(mirror, True, time.monotonic())
        gone.join(20.0)
    finally:
        answering.close()
    words, *then = did[before:]
    assert "0.3" in words
    assert then == ["flush", "sent"]


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
