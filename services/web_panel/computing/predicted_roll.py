"""Predicted roll of a set of values, and the envelope's verdict on it. Pure."""

from collections.abc import Mapping
from typing import Any

from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.cycles.settling import settle
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.table import Refusal, table_of, with_changes
from drumstick.stick.law import law_of
from web_panel.computing.computing_messages import PredictedRoll


def predicted_roll(scene: Scene, values: Mapping[str, float], limits: Mapping[str, float]) -> PredictedRoll:
    """`values` by wire names, SI; `limits` as envelope.Limits has them, or empty: those of the scene's guard."""
    try:
        law = with_changes(law_of(scene), table_of(scene), values)
    except Refusal as refusal:
        return PredictedRoll(refusal=str(refusal))
    why = ""
    try:
        given: dict[str, Any] = dict(limits)
        envelope.require(law, envelope.Limits(**given) if given else envelope.Limits.of(scene))
    except Refusal as refusal:
        why = str(refusal)
    if any(name in scene.effects for name in NEVER_REPEATING):
        return PredictedRoll("endless", refusal=why)
    end, cycle = settle(law, scratch_of(scene), scene.hand.throw_m_per_s)
    if cycle is None:
        return PredictedRoll(end, refusal=why)
    return PredictedRoll(end, cycle.v_e_m_per_s, cycle.rate_Hz, cycle.multiplier, cycle.period, why)
