"""The process that finds rolls, seen from the gateway, where it ends on its own."""

import sys

from haptic_server.gateway.rolls.finder_process import FinderProcess
from haptic_server.gateway.rolls.messages import Predict, Predicted, Refused

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
