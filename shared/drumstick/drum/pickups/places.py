"""Moving the pickups of a drum that plays: its gains are computed here, and handed to the thread that plays it.

One thread at a time moves the pickups of an engine; it allocates, and takes up to 0.1 s for a large bank. What it lays
out is not read while `is_still`: on a mesh each pickup has two sets of junctions, of which one is silent.
"""

from typing import Any, NamedTuple

import numpy.typing as npt

from drumstick.drum.effects.registry import EFFECTS
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.heads import pickups_moved
from drumstick.drum.memory.pickup_fade import DONE, OFFERED, gains_of
from drumstick.drum.pickups.fade import settle_now
from drumstick.drum.stems.separation import listening_by
from drumstick.parameters.scene import Scene
from realtime.atomics import peek, poke
from realtime.records import is_there

Array = npt.NDArray[Any]


class OtherPlaces(NamedTuple):
    """Values of an engine's arrays for its pickups to hear elsewhere: at once, and by a fade; and which half of the
    junctions sounds then."""

    junctions: list[Array]
    gains: list[Array]
    half: int


def is_still(engine: Engine) -> bool:
    """True while no fade goes on, and none is to begin."""
    cells = engine.pickup_fade.cells
    return peek(cells, DONE) == peek(cells, OFFERED)


def _junctions(engine: Engine) -> list[Array]:
    return [engine.pickups, *(part.pickups for part in engine.effects if hasattr(part, "pickups"))]


def other_places(engine: Engine, scene: Scene) -> OtherPlaces:
    """Compute what `engine`, or a copy that was moved as often, needs to hear at the places of `scene`: the (fitted)
    one that it is of, moved."""
    elsewhere, half = engine, 1 - int(engine.pickup_fade.state["half"][0])
    if is_there(engine.head):
        pickups, gains = pickups_moved(scene, engine.head, 1.0, engine.pickups, half)
        effects: Any = engine.effects
        for name, module in EFFECTS.items():
            part = getattr(effects, name, None)
            if is_there(part) and hasattr(module, "moved"):
                effects = effects._replace(**{name: module.moved(part, scene, half)})
        elsewhere = engine._replace(pickups=pickups, pickup_gains=gains, effects=effects)
    fresh = listening_by(elsewhere, scene, engine.pickup_fade.apart.tolist())
    return OtherPlaces(_junctions(fresh), [gains for gains in gains_of(fresh) if gains.size], half)


def fade_to(engine: Engine, places: OtherPlaces) -> None:
    """Let a fade lead there, with the next step, or with none while the drum is silent. Only while it `is_still`."""
    goals = [goal for _, goal in engine.pickup_fade.ramps]
    for array, values in (
        *zip(_junctions(engine), places.junctions, strict=True),
        *zip(goals, places.gains, strict=True),
    ):
        array[:] = values
    engine.pickup_fade.state["half"] = places.half
    cells = engine.pickup_fade.cells
    poke(cells, OFFERED, peek(cells, OFFERED) + 1)


def be_at(engine: Engine, places: OtherPlaces) -> None:
    """Have an engine that nobody plays hear there from its first step on."""
    fade_to(engine, places)
    settle_now(engine)
