"""`python -m web_panel.computing`: answers to the panel's questions (realtime.worker_process)."""

from drumstick.scenes.scene_text import from_tables
from drumstick.scenes.table import Refusal
from realtime.worker_process import serve
from web_panel.computing.computing_messages import (
    Answer,
    FindReach,
    FindTheory,
    PredictRoll,
    Question,
    Trouble,
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


if __name__ == "__main__":
    serve(Question, answer)
