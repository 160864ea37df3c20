"""The process that computes beside the page: asked without waiting, back when it died, gone with the panel."""

import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import as_tables, parse, shipped_text
from web_panel.computing import computer as computers
from web_panel.computing.computer import COMMAND, Computer
from web_panel.computing.computing_messages import Answer, PredictedRoll, PredictRoll, TimeTicks, Trouble

BAD = TimeTicks({"stick": {"m_kg": -1.0}})
# Answers with the value that it was asked about and how many questions came, once there is a file to answer by; ends
# when asked about 0.
STAND_IN = """
import json, pathlib, sys, time
for count, line in enumerate(sys.stdin, 1):
    value = json.loads(line)["values"]["dv_pls"]
    if value == 0.0:
        sys.exit(1)
    while not pathlib.Path(sys.argv[1]).exists():
        time.sleep(0.001)
    answer = {"type": "predicted_roll", "end": "cycle", "v_lc_m_per_s": value, "rate_Hz": count}
    print(json.dumps(answer), flush=True)
"""


def about(value: float) -> PredictRoll:
    return PredictRoll({}, {"dv_pls": value}, {})


@pytest.fixture
def computer() -> Iterator[Computer]:
    made = Computer()
    yield made
    made.close()


@pytest.fixture
def may_answer(tmp_path: Path) -> Path:
    return tmp_path / "may answer"


@pytest.fixture
def held(may_answer: Path) -> Iterator[Computer]:
    made = Computer([sys.executable, "-c", STAND_IN, str(may_answer)])
    yield made
    made.close()


def answered(computer: Computer, question: object) -> Answer:
    end = time.monotonic() + 60.0
    while (newest := computer.newest) is None or newest.question is not question:
        assert time.monotonic() < end
        time.sleep(0.005)
    return newest.answer


def test_a_wrong_scene_is_told(computer: Computer) -> None:
    computer.ask(BAD)
    told = answered(computer, BAD)
    assert isinstance(told, Trouble)
    assert "m_kg" in told.why
    assert not told.passes
    assert not computer.busy


def test_the_process_itself_foresees(computer: Computer) -> None:
    """A roll whose pulse is too strong for its range: no kernel is needed to say so."""
    roll = parse(shipped_text("roll"), "roll.toml")
    question = PredictRoll(as_tables(roll), {"dv_pls": 11.0}, {})
    computer.ask(question)
    assert answered(computer, question) == PredictedRoll(refusal="dv_pls: 11 m/s is outside 0 .. 10 m/s")


def test_the_newest_question_wins_and_asking_never_waits(held: Computer, may_answer: Path) -> None:
    questions = [about(0.001 * step) for step in range(1, 1001)]
    for question in questions:
        held.ask(question)  # returns, though nothing is answered yet
    assert held.busy
    assert held.newest is None
    may_answer.touch()
    newest = answered(held, questions[-1])
    assert isinstance(newest, PredictedRoll)
    assert newest.v_lc_m_per_s == questions[-1].values["dv_pls"]
    assert newest.rate_Hz <= 2, "all between the first and the newest were left out"


def test_a_process_that_ends_is_told_and_started_again(held: Computer, may_answer: Path) -> None:
    may_answer.touch()
    ending, after = about(0.0), about(0.5)
    held.ask(ending)
    told = answered(held, ending)
    assert isinstance(told, Trouble)
    assert told.passes
    held.ask(after)
    assert answered(held, after) == PredictedRoll("cycle", 0.5, 1)


def test_a_question_that_ends_the_process_each_time_is_given_up(
    held: Computer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(computers, "_TRIES", 2)
    monkeypatch.setattr(computers, "_AGAIN_AFTER_S", 0.0)
    passes: list[bool] = []
    for _ in range(3):
        ending = about(0.0)
        held.ask(ending)
        told = answered(held, ending)
        assert isinstance(told, Trouble)
        passes.append(told.passes)
    assert passes == [True, False, False]


def test_what_is_forgotten_is_not_answered(held: Computer, may_answer: Path) -> None:
    forgotten, other = about(0.1), about(0.2)
    held.ask(forgotten)
    held.forget()
    assert not held.busy
    may_answer.touch()
    held.ask(other)
    told = answered(held, other)
    assert isinstance(told, PredictedRoll)
    assert told.v_lc_m_per_s == 0.2
    held.forget()
    assert held.newest is None


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
