"""`python -m web_panel.computing`: questions on the standard input, answers on the standard output, at a low priority.

It ends with the panel, however that ends: then its input is closed.
"""

import os
import sys

import msgspec

from drumstick.scenes.scene_text import from_tables
from drumstick.scenes.table import Refusal
from web_panel.computing.computing_messages import (
    Answer,
    FindReach,
    FindTheory,
    PredictRoll,
    Question,
    Trouble,
)

_NICENESS = (
    5  # behind everything else that runs; much more, and a busy machine would not get to it for minutes
)


def answer(question: Question) -> Answer:
    """Blocks: 5 to 40 ms for PredictRoll, about a second for the others, the first time for as long as kernels
    compile."""
    try:
        scene = from_tables(question.scene)
        if isinstance(question, PredictRoll):
            from web_panel.computing.predicted_roll import predicted_roll

            return predicted_roll(scene, question.values, question.limits)
        if isinstance(question, FindTheory):
            from web_panel.computing.theory import theory_of

            return theory_of(scene, question.values)
        if isinstance(question, FindReach):
            from web_panel.computing.reach import reach_of

            return reach_of(scene, question.values, question.limits)
        from web_panel.computing.tick_costs import ticks_of

        return ticks_of(scene)
    except (Refusal, ArithmeticError, ValueError) as error:
        return Trouble(str(error))


def main() -> None:
    """Answer until the input ends."""
    os.nice(_NICENESS)
    for line in sys.stdin.buffer:
        sys.stdout.buffer.write(msgspec.json.encode(answer(msgspec.json.decode(line, type=Question))) + b"\n")
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
