"""Predicted roll of a set of values, and the envelope's verdict on it. Pure."""

import math
from collections.abc import Mapping
from typing import Any

from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.cycles.settling import settle
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.table import Parameter, Refusal, table_of, values_of, with_changes
from drumstick.stick.law import Records, law_of
from web_panel.computing.computing_messages import PredictedRoll

_HALVINGS = 12  # to a hundredth of a slider's travel, or finer


def predicted_roll(scene: Scene, values: Mapping[str, float], limits: Mapping[str, float]) -> PredictedRoll:
    """`values` by wire names, SI; `limits` as envelope.Limits has them, or empty: those of the scene's guard."""
    try:
        law = with_changes(law_of(scene), table_of(scene), values)
    except Refusal as refusal:
        return PredictedRoll(refusal=str(refusal))
    why, given = "", dict[str, Any](limits)
    envelopes_limits = envelope.Limits(**given) if given else envelope.Limits.of(scene)
    try:
        envelope.require(law, envelopes_limits)
    except Refusal as refusal:
        why = str(refusal)
    open_ = {} if why else open_ranges(law, table_of(scene), envelopes_limits)
    if any(name in scene.effects for name in NEVER_REPEATING):
        return PredictedRoll("endless", refusal=why, open=open_)
    end, cycle = settle(law, scratch_of(scene), scene.hand.throw_m_per_s)
    if cycle is None:
        return PredictedRoll(end, refusal=why, open=open_)
    return PredictedRoll(end, cycle.v_e_m_per_s, cycle.rate_Hz, cycle.multiplier, cycle.period, why, open_)


def open_ranges(
    law: Records, table: Mapping[str, Parameter], limits: envelope.Limits
) -> dict[str, tuple[float, float]]:
    """Lowest and highest accepted value of each parameter that the envelope bounds, with the others as in `law`.

    `law`, shape (1,), is accepted itself. By halving, as if all values between an accepted and a refused one were
    parted once; 0.02 ms a check on the exact stick, about 0.3 ms on a sampled arm.
    """
    record, scratch = limits.record(), envelope.new_scratch()

    def accepts(name: str, value: float) -> bool:
        try:
            changed = with_changes(law, table, {name: value})
        except Refusal:
            return False
        return envelope.judge(changed[0], record[0], scratch).code == envelope.OK

    def farthest(name: str, value: float, end: float, by_ratio: bool) -> float:
        if accepts(name, end):
            return end
        for _ in range(_HALVINGS):
            middle = math.sqrt(value * end) if by_ratio else 0.5 * (value + end)
            value, end = (middle, end) if accepts(name, middle) else (value, middle)
        return value

    found: dict[str, tuple[float, float]] = {}
    for name, value in values_of(law, table).items():
        q = table[name].quantity
        if not (q.low <= value <= q.high):
            continue
        by_ratio = q.scale == "log" and q.low > 0.0
        ends = (farthest(name, value, q.low, by_ratio), farthest(name, value, q.high, by_ratio))
        if ends != (q.low, q.high):
            found[name] = ends
    return found
