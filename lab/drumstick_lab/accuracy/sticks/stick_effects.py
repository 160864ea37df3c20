"""Cost of each effect of the stick per tick, and the roll without it. Any thread; blocks for seconds.

Each by the shipped scene that names it, whose stick and tables are taken: alone, beside that stick with none. Left to
themselves the two would move differently, one roll and the other lie: so both go one tick from every state that the
stick with the effect comes through. And the rate of that scene's roll with all that it has, and without this one.

What is added depends on the playing: noise alone makes no roll, its stick lies in the head for most of its ticks, and each
new force, one a tick, begins another segment there. Of a stick in flight it costs next to nothing.
"""

import dataclasses
import statistics
from collections.abc import Sequence
from typing import Any

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick import cost
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick.stick.law import law_of, motion_type, thrown
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from drumstick.stick.simulate import COLUMNS, simulate
from drumstick_lab.accuracy.timing import CHAIN, ENGINES, Window, apart, chain, in_turn, spent_ns
from realtime.kernels.jit import njit
from realtime.records import Records

ALL, NONE = "all", "none"
NAMED_BY = {
    "pulse": "roll",
    "cor_pulse": "cor-roll",
    "system_delay": "delay-drum",
    "hysteretic_spring": "rejected-by-the-paper",
    "negative_damping": "rejected-by-the-paper",
    "noise": "rejected-by-the-paper",
    "chaos": "rejected-by-the-paper",
}
QUICK = (
    "pulse",
    "cor_pulse",
    "system_delay",
)  # alone in a shipped scene, whose kernels the player compiles anyway
_TICKS = 2000  # two seconds of a roll; their states stay in the processor's second cache
_ROLL_S = 4.0
_T_IN = COLUMNS.index("t_in_s")


def scene_of(effect: str) -> Scene:
    """The shipped scene that names it."""
    name = NAMED_BY[effect]
    return parse(shipped_text(name), name)


def _alone(scene: Scene, *effects: str) -> Scene:
    return dataclasses.replace(scene, effects={name: scene.effects[name] for name in effects})


def _all() -> Scene:
    # Every effect as its own scene has it, on the stick of the roll.
    return dataclasses.replace(
        scene_of("pulse"), effects={name: scene_of(name).effects[name] for name in STICK_TABLES}
    )


def roll_rate(scene: Scene) -> float | None:
    """Contacts a second, Hz, in the second half of four seconds; None where the stick rests or has left by then."""
    contacts = simulate(scene, _ROLL_S, scene.hand.throw_m_per_s).contacts[:, _T_IN]
    settled = contacts[contacts > 0.5 * _ROLL_S]
    return (len(settled) - 1) / float(settled[-1] - settled[0]) if len(settled) > 1 else None


@njit()
def _tick(law: Law, motion: Motion, period_s: float) -> None:
    moved = 0.0
    while moved < period_s and motion.outcome == exact.MOVING:
        event, duration = exact.advance(law, motion, period_s - moved)
        moved += duration
        if event == exact.HORIZON:
            break


@njit()
def _each(law: Law, motions: Records, period_s: float) -> None:
    # A tick from each state, whatever became of the others.
    for k in range(motions.shape[0]):
        _tick(law, motions[k], period_s)


def states(scene: Scene) -> Records:
    """State of the stick at the beginning of so many ticks; one that lies dead or has left is thrown again."""
    law, motion = law_of(scene), thrown(scene, scene.hand.throw_m_per_s)
    kept = np.zeros(_TICKS, motion.dtype)
    for k in range(_TICKS):
        if motion["outcome"][0] != exact.MOVING:
            motion = thrown(scene, scene.hand.throw_m_per_s)
        kept[k] = motion[0]
        _tick(law[0], motion[0], 1.0 / scene.servo.rate_Hz)
    return kept


def bare(kept: Records) -> Records:
    """These states of a stick without effects."""
    found = np.zeros(len(kept), motion_type(()))
    for name in found.dtype.names or ():
        found[name] = kept[name]
    return found


def _ticking(scene: Scene, kept: Records) -> Window:
    law, motions = law_of(scene), kept.copy()
    period_s = 1.0 / scene.servo.rate_Hz

    def window() -> float:
        motions[:] = kept
        return spent_ns(lambda: _each(law[0], motions, period_s)) / len(kept)

    return window


def _rates(effect: str) -> dict[str, float | None]:
    if effect in (ALL, NONE):
        return {"rate_Hz": roll_rate(_all() if effect == ALL else _alone(scene_of("pulse")))} | {
            "rate_without_Hz": None
        }
    scene = scene_of(effect)
    return {
        "rate_Hz": roll_rate(scene),
        "rate_without_Hz": roll_rate(cost.without(scene, effect)),
    }


def tick_rows(effects: Sequence[str], rounds: int) -> tuple[list[dict[str, Any]], float]:
    """One row each, with nothing and with everything at the ends, all timed in the same rounds; ns of CHAIN.

    Nothing is the stick of the roll without its pulse, along the roll. What is added is the median over engines, each
    beside one without along the same states; `spread_ns` is half of what they span.
    """
    cases = {NONE: _alone(scene_of("pulse"), "pulse")} | {
        name: _alone(scene_of(name), name) for name in effects
    }
    cases |= {ALL: _all()}
    windows: dict[str, Window] = {CHAIN: chain()}
    for name, scene in cases.items():
        kept = states(scene)
        for k in range(ENGINES):
            windows[f"{name} {k}"] = _ticking(scene, kept)
            windows[f"{name} {k} bare"] = _ticking(_alone(scene), bare(kept))
    ns = in_turn(windows, rounds)
    rows: list[dict[str, Any]] = []
    for name in cases:
        others = [ns[f"{name} {k} bare"] for k in range(ENGINES)]
        own = others if name == NONE else [ns[f"{name} {k}"] for k in range(ENGINES)]
        added_ns, spread_ns = apart(own, others)
        row: dict[str, Any] = {"effect": name, "ns_per_tick": statistics.median(own)}
        row |= {"added_ns": added_ns, "spread_ns": spread_ns, "ratio": statistics.median(own) / ns[CHAIN]}
        rows.append(row | _rates(name))
    return rows, ns[CHAIN]
