"""The process that computes beside the page: asked without waiting, back when it died, gone with the panel."""

import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from drumstick.scenes.scene_text import as_tables, parse, shipped_text
from web_panel.computing.computer import COMMAND, Computer
from web_panel.computing.computing_messages import Answer, PredictedRoll, PredictRoll, TimeTicks, Trouble

BAD = TimeTicks({"stick": {"m_kg": -1.0}})
# Answers with the value that it was asked about, slowly, and ends when asked about 0.
STAND_IN = """
import json, sys, time
for line in sys.stdin:
    value = json.loads(line)["values"]["dv_pls"]
    if value == 0.0:
        sys.exit(1)
    time.sleep(0.05)
    print(json.dumps({"type": "predicted_roll", "end": "cycle", "v_lc_m_per_s": value}), flush=True)
"""


def about(value: float) -> PredictRoll:
    return PredictRoll({}, {"dv_pls": value}, {})


@pytest.fixture
def computer() -> Iterator[Computer]:
    made = Computer()
    yield made
    made.close()


@pytest.fixture
def slow() -> Iterator[Computer]:
    made = Computer([sys.executable, "-c", STAND_IN])
    yield made
    made.close()


def answered(computer: Computer, question: object) -> Answer:
    end = time.monotonic() + 60.0
    while (newest := computer.newest) is None or newest.question is not question:
        assert time.monotonic() < end
        time.sleep(0.005)
    return newest.answer


def test_a_wrong_scene_is_told_and_asking_does_not_wait(computer: Computer) -> None:
    begun = time.monotonic()
    computer.ask(BAD)
    assert time.monotonic() - begun < 5.0
    assert computer.busy
    told = answered(computer, BAD)
    assert isinstance(told, Trouble)
    assert "m_kg" in told.why
    assert not computer.busy


def test_the_process_itself_foresees(computer: Computer) -> None:
    """A roll whose pulse is too strong for its range: no kernel is needed to say so."""
    roll = parse(shipped_text("roll"), "roll.toml")
    question = PredictRoll(as_tables(roll), {"dv_pls": 11.0}, {})
    computer.ask(question)
    assert answered(computer, question) == PredictedRoll(refusal="dv_pls: 11 m/s is outside 0 .. 10 m/s")


def test_the_newest_question_wins_and_asking_never_waits(slow: Computer) -> None:
    questions = [about(0.001 * step) for step in range(1, 1001)]
    begun = time.monotonic()
    for question in questions:
        slow.ask(question)
    asking_s = time.monotonic() - begun
    assert answered(slow, questions[-1]) == PredictedRoll("cycle", questions[-1].values["dv_pls"])
    assert time.monotonic() - begun < 0.05 * len(questions) / 4
    assert asking_s < 0.05 * len(questions) / 4


def test_a_process_that_ends_is_told_and_started_again(slow: Computer) -> None:
    ending, after = about(0.0), about(0.5)
    slow.ask(ending)
    assert isinstance(answered(slow, ending), Trouble)
    slow.ask(after)
    assert answered(slow, after) == PredictedRoll("cycle", 0.5)


def test_what_is_forgotten_is_not_answered(slow: Computer) -> None:
    forgotten, other = about(0.1), about(0.2)
    slow.ask(forgotten)
    slow.forget()
    assert not slow.busy
    slow.ask(other)
    assert answered(slow, other) == PredictedRoll("cycle", 0.2)
    slow.forget()
    assert slow.newest is None


def test_the_process_ends_when_its_input_does() -> None:
    with subprocess.Popen(COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.communicate(timeout=60.0)
        assert process.returncode == 0


@pytest.mark.long
def test_a_process_that_cannot_be_started_is_told_and_tried_again() -> None:
    computer = Computer(["/nowhere/at-all"])
    try:
        first, second = about(0.1), about(0.2)
        computer.ask(first)
        told = answered(computer, first)
        assert isinstance(told, Trouble)
        assert "cannot be started: No such file or directory" in told.why
        computer.ask(second)
        assert isinstance(answered(computer, second), Trouble)
    finally:
        computer.close()
