"""What each effect of the stick costs a tick, and what leaving it out does to the roll. Any thread; blocks for seconds.

Each by the shipped scene that names it, whose stick and tables are taken: alone, beside that stick with none; and the
rate of that scene's roll with all that it has, and without this one.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

from drumstick import cost
from drumstick.scene import EFFECTS, Scene, parse, shipped_text
from drumstick.simulate import COLUMNS, simulate
from rig.accuracy.timing import CHAIN, Window, chain, in_turn

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
_TICKS = 10_000
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
        scene_of("pulse"), effects={name: scene_of(name).effects[name] for name in EFFECTS}
    )


def roll_rate(scene: Scene) -> float | None:
    """Contacts a second, Hz, in the second half of four seconds; None where the stick rests or has left by then."""
    contacts = simulate(scene, _ROLL_S, scene.hand.throw_m_per_s).contacts[:, _T_IN]
    settled = contacts[contacts > 0.5 * _ROLL_S]
    return (len(settled) - 1) / float(settled[-1] - settled[0]) if len(settled) > 1 else None


def _ticking(scene: Scene) -> Window:
    return lambda: cost.tick_cost(scene, _TICKS).ns


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
    """One row each, with nothing and with everything at the ends, all timed in the same rounds; ns of CHAIN."""
    bare = {scene_of(name).name: _alone(scene_of(name)) for name in ("pulse", *effects)}
    cases = {name: _alone(scene_of(name), name) for name in effects}
    cases = {NONE: bare["roll"]} | cases | {ALL: _all()}
    windows = {CHAIN: chain()} | {f"bare {name}": _ticking(scene) for name, scene in bare.items()}
    ns = in_turn(windows | {name: _ticking(scene) for name, scene in cases.items()}, rounds)
    rows = [
        {
            "effect": name,
            "ns_per_tick": ns[name],
            "added_ns": 0.0 if name == NONE else ns[name] - ns[f"bare {NAMED_BY.get(name, 'roll')}"],
            "ratio": ns[name] / ns[CHAIN],
        }
        | _rates(name)
        for name in cases
    ]
    return rows, ns[CHAIN]
