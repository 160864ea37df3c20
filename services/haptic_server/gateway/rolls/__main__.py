"""`python -m haptic_server.gateway.rolls`: answers to what the gateway asks of rolls (realtime.worker_process)."""

from drumstick.analysis.inverse import Inverse, Roll
from drumstick.parameters.scene import Scene
from drumstick.safety.envelope import Limits
from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import table_of, with_changes
from drumstick.stick.law import law_of
from haptic_server import files, limits
from haptic_server.gateway.options import GatewayOptions
from haptic_server.gateway.rolls.messages import Answer, FindRamp, Predicted, Question, Refused
from realtime.regular_file import read_text
from realtime.service_options import options_of_process
from realtime.worker_process import serve


class Finder:
    """Answers of one scene. Raises Refusal where it makes no roll whose rate and level could be set."""

    def __init__(self, scene: Scene, allowed: Limits) -> None:
        self._scene, self._table = scene, table_of(scene)
        self._inverse = Inverse(scene, allowed)
        self._last: Roll | None = None

    def answer(self, question: Question) -> Answer:
        """Blocks for some milliseconds, the first time for as long as kernels compile."""
        inverse, last = self._inverse, self._last
        try:
            law = with_changes(law_of(self._scene), self._table, question.values)
            if not isinstance(question, FindRamp):
                roll = inverse.roll(law)
                return Predicted(roll.rate_Hz, roll.level) if roll else Predicted()
            on_way = question.under_way
            start = inverse.played(last, on_way) if on_way and last else inverse.present(law)
            ramp, self._last = inverse.ramp(start, question.rate, question.level)
            return ramp
        except (ArithmeticError, ValueError) as error:  # a Refusal is one
            return Refused(str(error))


def main() -> None:
    """Answer until the input ends."""
    run_dir = options_of_process(GatewayOptions, "haptic_server.gateway.rolls").run_dir
    scene = parse(read_text(run_dir / files.SCENE, files.MAX_SCENE_BYTES), str(run_dir / files.SCENE))
    serve(Question, Finder(scene, limits.read(run_dir, scene)).answer)


if __name__ == "__main__":
    main()
