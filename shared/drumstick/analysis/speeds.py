"""v_lc three ways over a range of dv: equation (7), the gain kappa, and what the exact motion settles into.

    found = roll_speeds(scene, np.linspace(0.05, 2.0, 60))

Any thread; blocks for some milliseconds a value.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from drumstick.analysis import predictions
from drumstick.analysis.cycles.return_step import Numbers, scratch_of
from drumstick.analysis.cycles.settling import settle
from drumstick.analysis.flight import flight
from drumstick.analysis.rebound import rebound
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of


class RollSpeeds(NamedTuple):
    """Arrays of shape (n,), m/s; NaN where a value does not exist. alpha and beta are those of the settled roll.

    settled: v_E that the scene's throw ends in, of the strongest contact. period: its contacts, 0 without a roll.
    """

    dv: Numbers
    eq7: Numbers
    kappa: Numbers
    settled: Numbers
    period: Numbers


def _at(scene: Scene, dv: float) -> tuple[float | None, float | None, float | None, int]:
    effects = dict(scene.effects)
    effects["pulse"] = dataclasses.replace(effects["pulse"], dv_m_per_s=dv)
    changed = dataclasses.replace(scene, effects=effects)
    roll = settle(law_of(changed), scratch_of(changed), scene.hand.throw_m_per_s).cycle
    if roll is None:
        return None, None, None, 0
    flown, struck = flight(changed, roll.v_e_m_per_s), rebound(changed, -roll.v_in_m_per_s)
    if flown is None:
        return None, None, roll.v_e_m_per_s, roll.period
    eq7 = predictions.v_lc_eq7(changed, flown.alpha)
    gained = predictions.v_lc_kappa(changed, flown.alpha, struck.beta if struck else None)
    return eq7, gained, roll.v_e_m_per_s, roll.period


def roll_speeds(scene: Scene, dv_m_per_s: Numbers) -> RollSpeeds:
    """The three speeds at every dv, shape (n,). Raises ValueError for a scene without pulse or without any cycle."""
    endless = [name for name in NEVER_REPEATING if name in scene.effects]
    if "pulse" not in scene.effects or endless:
        why = f"{endless[0]} never repeats" if endless else "it has no [effects.pulse]"
        raise ValueError(f"scene {scene.name!r} has no speed of the roll to predict: {why}")
    rows = [_at(scene, float(dv)) for dv in dv_m_per_s]
    columns = [np.array([np.nan if x is None else x for x in column]) for column in zip(*rows, strict=True)]
    return RollSpeeds(np.asarray(dv_m_per_s, np.float64), *columns)
