"""Cost of a tick on this machine with each effect and without it. Blocks for a second; compiles the first time."""

import dataclasses

from drumstick.parameters.scene import Scene
from drumstick.stick import cost
from web_panel.computing.computing_messages import Ticks

_TICKS, _REPEATS = 4000, 5


def ticks_of(scene: Scene) -> Ticks:
    """Time the tick: the quickest of five runs of 4000 ticks each."""
    variants = {"all": scene} | {name: cost.without(scene, name) for name in scene.effects}
    variants["none"] = dataclasses.replace(scene, effects={})
    ns = {
        name: min(cost.tick_cost(variant, _TICKS).ns for _ in range(_REPEATS))
        for name, variant in variants.items()
    }
    return Ticks(ns, scene.servo.rate_Hz)
