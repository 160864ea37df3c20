"""The process that finds rolls, seen from the gateway, where it ends on its own."""

import sys
from pathlib import Path

from haptic_server.gateway.rolls.finder_process import FinderProcess
from haptic_server.gateway.rolls.messages import Predict, Predicted, Refused
from osc_bench import Time

_ONE_ANSWER = """
import sys
sys.stdin.readline()
print('{"type":"predicted","rate_Hz":20.0,"level":0.5}', flush=True)
"""
_ASKED = Predict({"k_hand": 20.0})


def test_one_that_ended_between_two_questions_is_started_again() -> None:
    finder = FinderProcess([sys.executable, "-c", _ONE_ANSWER])
    for _ in range(2):
        assert finder.ask(_ASKED) == Predicted(20.0, 0.5)
        assert finder._process is not None  # pyright: ignore[reportPrivateUsage]
        finder._process.wait()  # pyright: ignore[reportPrivateUsage]
    finder.close()
    assert isinstance(finder.ask(_ASKED), Refused)


def test_one_that_ends_in_place_of_an_answer_is_not_started_with_every_question(tmp_path: Path) -> None:
    starts, now = tmp_path / "starts", Time()
    finder = FinderProcess([sys.executable, "-c", f"open({str(starts)!r}, 'a').write('x')"], now)
    for _ in range(10):
        assert isinstance(finder.ask(_ASKED), Refused)
    assert starts.read_text() == "x"
    now.s += 11.0
    assert isinstance(finder.ask(_ASKED), Refused)
    assert starts.read_text() == "xx"
    finder.close()
