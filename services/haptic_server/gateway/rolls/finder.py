"""The process that finds rolls: questions on standard input, answers on standard output, at a low priority.

A process of its own, since the first answer waits until kernels are compiled, and the interpreter with it. It ends with
the gateway, however that ends: then its input is closed.
"""

import os
import sys

import msgspec

from drumstick.analysis.inverse import Inverse, Roll
from drumstick.analysis.ramp import ramp_to
from drumstick.parameters.scene import Scene
from drumstick.safety.envelope import Limits
from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import table_of, with_changes
from drumstick.stick.law import law_of
from drumstick.stick.strike_curve import level_at
from haptic_server import files, limits
from haptic_server.gateway.rolls.messages import Answer, FindRamp, Found, Predicted, Question, Refused
from haptic_server.gateway.rolls.options import FinderOptions
from realtime.regular_file import read_text
from realtime.service_options import options_of_process

_NICENESS = 5  # behind everything that plays; much more, and a busy machine would not get to it for minutes


class Finder:
    """Answers of one scene. Raises Refusal where it makes no roll whose rate and level could be set."""

    def __init__(self, scene: Scene, allowed: Limits) -> None:
        self._scene, self._table = scene, table_of(scene)
        self._inverse = Inverse(scene, allowed)
        self._last: Roll | None = None

    def answer(self, question: Question) -> Answer:
        """Blocks for some milliseconds, the first time for as long as kernels compile."""
        try:
            law = with_changes(law_of(self._scene), self._table, question.values)
            if not isinstance(question, FindRamp):
                if (on_way := question.under_way) is not None:
                    return Predicted(on_way.rate_Hz, level_at(self._scene.strike, on_way.speed_m_per_s))
                roll = self._inverse.roll(law)
                return Predicted(roll.rate_Hz, roll.level) if roll else Predicted(0.0, 0.0)
            if question.under_way is not None and self._last is not None:
                start = self._inverse.played(self._last, *question.under_way)
            else:
                start = self._inverse.present(law)
            ramp, self._last = ramp_to(self._inverse, start, question.rate, question.level)
            return Found(ramp)
        except (ArithmeticError, ValueError) as error:  # a Refusal is one
            return Refused(str(error))


def main() -> int:
    """Answer until the input ends."""
    given = options_of_process(FinderOptions, "haptic_server.gateway.rolls")
    os.setpriority(os.PRIO_PROCESS, 0, _NICENESS)  # whatever the gateway's own is
    path = given.run_dir / files.SCENE
    scene = parse(read_text(path, files.MAX_SCENE_BYTES), str(path))
    finder = Finder(scene, limits.read(given.run_dir, scene))
    for line in sys.stdin.buffer:
        answer = finder.answer(msgspec.json.decode(line, type=Question))
        sys.stdout.buffer.write(msgspec.json.encode(answer) + b"\n")
        sys.stdout.buffer.flush()
    return 0
