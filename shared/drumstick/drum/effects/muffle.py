"""`muffle`: patches of gel or felt on the head, each braking the junctions under it.

A junction with losses of its own, s_m besides those of the head, ends a step at u+ + g (u- - u+), where
g = s_m/(1 + s + s_m): the damper is taken at the middle of the step, so it only takes energy, however strong it is.
Kernels: audio thread.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import internal_loss
from drumstick.drum.membrane.sweep import bend_at
from realtime.kernels.jit import only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]


class Muffle(NamedTuple):
    """Shapes (n,): the junctions under patches, their g, and the u- that the sweep overwrites."""

    places: npt.NDArray[np.int64]
    shares: Floats
    before: Floats


@only_with("muffle")
def note(engine: "Engine", then: Floats) -> None:
    """Before the sweep: keep u- where it will be needed."""
    for i in range(engine.muffle.places.shape[0]):
        engine.muffle.before[i] = then[engine.muffle.places[i]]


@only_with("muffle", otherwise=0.0)
def brake(engine: "Engine", then: Floats) -> float:
    """After the sweep: let the patches brake; returns by how much the sum of u+ changed."""
    changed = 0.0
    muffle = engine.muffle
    for i in range(muffle.places.shape[0]):
        at = muffle.places[i]
        step = muffle.shares[i] * (muffle.before[i] - then[at])
        then[at] += step
        internal_loss.push(engine, at, step)
        changed += step
    return changed


@only_with("muffle", otherwise=0.0)
def hidden_stretch(engine: "Engine", share: Floats, now: Floats, own_gain: float) -> float:
    """What the masses of `share`, less by g under a patch, leave out of sum M d u-: before the sweep, after `note`."""
    muffle, hidden = engine.muffle, 0.0
    for i in range(muffle.places.shape[0]):
        at, g = muffle.places[i], float(muffle.shares[i])
        hidden += share[at] * g / (1.0 - g) * bend_at(engine.head, now, at, own_gain) * muffle.before[i]
    return hidden
