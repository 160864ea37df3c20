"""Prediction for the value under the thumb, shown above the sliders, where no hand hides it."""

import viser

from web_panel.computing.computing_messages import Trouble
from web_panel.page import markup
from web_panel.page.wording import is_no_roll, prediction_words
from web_panel.rig.rig_state import RigState
from web_panel.tuning.compare import settable
from web_panel.tuning.prediction import Newest, Prediction

_REQUEST_SHOWN_S = 2.0  # one that was refused stays to be looked at for so long


class PredictionLine:
    """Made and shown by the main thread. Nothing is computed while nobody looks."""

    def __init__(self, server: viser.ViserServer, prediction: Prediction, order: float) -> None:
        self._prediction = prediction
        self.no_roll = False  # predicted for the values that are used
        self.accepted: dict[str, tuple[float, float]] = {}  # ends of what the envelope accepts, by wire name
        self._content = markup.line("", "prediction", lines=3)
        self._handle = server.gui.add_html(self._content, order=order)

    def show(self, rig_state: RigState, is_seen: bool, now: float) -> None:
        """Ask about what holds when nobody has requested anything lately, and write the newest answer."""
        if rig_state.scene is not None and is_seen:
            self._prediction.show_for(rig_state.scene, rig_state.limits)
            standing = settable(rig_state.standing())
            asked = self._prediction.asked
            if standing and (
                asked is None or (asked != standing and now - self._prediction.asked_at > _REQUEST_SHOWN_S)
            ):
                self._prediction.ask(standing)
            self._prediction.ask_again()
        content = self._words(rig_state, self._prediction.newest, now)
        if content != self._content:
            self._content = self._handle.content = content

    def _words(self, rig_state: RigState, newest: Newest | None, now: float) -> str:
        self.no_roll = False
        if rig_state.state is not None and rig_state.state.status not in ("ready", "playing"):
            return markup.line("No prediction while the force is off.", "prediction", lines=3)
        if self._prediction.asked is None:
            self.accepted = {}
            return markup.line("", "prediction", lines=3)
        if newest is None:
            self.accepted = {}
            words = "Prediction: being prepared; the first time takes a minute."
            return markup.line(words, "prediction", lines=3)
        values, predicted = newest
        if isinstance(predicted, Trouble):
            self.accepted = {}
            return markup.line(f"No prediction: {predicted.why}.", "prediction", alarm=True, lines=3)
        if not predicted.refusal:
            self.accepted = predicted.open
        used = {name: readback.value for name, readback in rig_state.readbacks.items()}
        other = {n: v for n, v in values.items() if n in used and v != used[n]}
        self.no_roll = not other and is_no_roll(predicted)
        words = prediction_words(predicted, other, rig_state.table)
        return markup.prediction(words, old=not rig_state.plays(now))
