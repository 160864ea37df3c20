"""Every effect of the stick at the ends of its ranges, on hard sticks; beside a loop of fixed steps."""

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import pytest

from drumstick.parameters.declare import quantities
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.registry import STICK_TABLES
from drumstick.stick.simulate import COLUMNS, Stepper, simulate
from stability.catalogue import shows
from stability.stick_play import play_on

EULER = Stepper("semi_implicit_euler", 1e-3, locates=False)
V_OUT = COLUMNS.index("v_out_m_per_s")
# Stiff and undamped, light and damped, soft and heavy under a strong hand.
STICKS = (
    Stick(0.015, 1e6, 0.0, 20.0, 0.0, -0.02, "paper"),
    Stick(1e-4, 1e6, 10.0, 20.0, 0.0, -0.02, "unilateral"),
    Stick(1.0, 1e3, 1e3, 1e4, 1e3, -1.0, "unilateral"),
)
# Those that share a record type with others, as in any_scene: the rest of them at their first corner.
HEAD = ("hysteretic_spring", "negative_damping", "noise", "chaos")


def corners(name: str) -> list[Any]:
    """The effect's table with each of its numbers at either end of its range, and with each choice."""
    ends = {
        key: quantity.choices or (quantity.kind(quantity.low), quantity.kind(quantity.high))
        for key, quantity in quantities(STICK_TABLES[name]).items()
    }
    return [
        STICK_TABLES[name](**dict(zip(ends, values, strict=True)))
        for values in itertools.product(*ends.values())
    ]


def scenes(name: str) -> list[Scene]:
    """Each corner of the effect on each stick."""
    beside = {other: corners(other)[0] for other in HEAD} if name in HEAD else {}
    return [
        Scene("corner", stick=stick, effects={**beside, name: table})
        for stick in STICKS
        for table in corners(name)
    ]


def _first_speeds(scene: Scene, stepper: Stepper | None) -> np.ndarray:
    return simulate(scene, 0.5, -0.4, stepper).contacts[:3, V_OUT]


@shows("effects at the ends of their ranges")
@pytest.mark.parametrize("name", STICK_TABLES)
def test_every_effect_at_the_ends_of_its_ranges(name: str) -> None:
    """On the stiff head a fixed step is wrong about one of the first three speeds, by a twentieth up to a million."""
    wrong, hard = 0, 0
    for scene in scenes(name):
        play_on(scene, -0.4, 0.05)
        if scene.stick is STICKS[0]:
            naive, ours = _first_speeds(scene, EULER), _first_speeds(scene, None)
            wrong += len(naive) != len(ours) or not np.allclose(naive, ours, rtol=0.05)
            hard += 1
    assert wrong > 0.7 * hard


def test_corners_are_all_of_them() -> None:
    for name, kind in STICK_TABLES.items():
        found = corners(name)
        assert len(found) == math.prod(len(q.choices) or 2 for q in quantities(kind).values())
        assert len({dataclasses.astuple(table) for table in found}) == len(found)
