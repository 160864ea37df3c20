"""`muffle`: patches of gel or felt on the head, each braking the junctions under it.

A junction with losses of its own, s_m besides those of the head, ends a step at u+ + g (u- - u+), where
g = s_m/(1 + s + s_m): the damper is taken at the middle of the step, so it only takes energy, however strong it is.
Kernels: audio thread.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import internal_loss
from drumstick.drum.membrane.scheme import even_losses
from drumstick.drum.membrane.sweep import bend_at
from drumstick.parameters.declare import number, numbers
from realtime.kernels.jit import only_with

if TYPE_CHECKING:
    from drumstick.drum.effects.registry import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class MuffleTable:
    """Gel, felt or a hand on the head."""

    patches: tuple[tuple[float, ...], ...] = numbers(
        ((0.75, 0.0, 0.15),), 3, -1.0, 1.0, "of the radius", "Patches, each [x, y, radius]"
    )
    t60_s: float = number(
        0.05, 0.001, 60.0, "s", "Time in which the junctions under a patch would lose 60 dB"
    )


TABLE = MuffleTable


Floats = npt.NDArray[np.float32]


class Muffle(NamedTuple):
    """Shapes (n,): the junctions under patches, their g, and the u- that the sweep overwrites."""

    places: npt.NDArray[np.int64]
    shares: Floats
    before: Floats


def part_of(building: "Building") -> Muffle:
    """The junctions under the scene's patches."""
    lattice, losses, step_s = building.lattice, building.numbers.losses, building.step_s
    table = building.scene.drum.effects["muffle"]
    s = even_losses(table.t60_s, step_s).s
    rows, columns = np.nonzero(lattice.weights)
    at = np.array([lattice.position(int(r), int(c)) for r, c in zip(rows, columns, strict=True)])
    under = np.zeros(len(at), bool)
    for x, y, radius in table.patches:
        under |= np.hypot(at[:, 0] - x, at[:, 1] - y) <= abs(radius)
    places = (rows * lattice.weights.shape[1] + columns)[under].astype(np.int64)
    shares = np.full(len(places), s / (1.0 + losses.s + s), np.float32)
    return Muffle(places, shares, np.zeros(len(places), np.float32))


@only_with("muffle")
def note(engine: "Engine", then: Floats) -> None:
    """Keep u- where it will be needed, before the sweep."""
    for i in range(engine.effects.muffle.places.shape[0]):
        engine.effects.muffle.before[i] = then[engine.effects.muffle.places[i]]


@only_with("muffle", otherwise=0.0)
def brake(engine: "Engine", then: Floats) -> float:
    """Brake the patches' junctions, after the sweep; returns by how much the sum of u+ changed."""
    changed = 0.0
    muffle = engine.effects.muffle
    for i in range(muffle.places.shape[0]):
        at = muffle.places[i]
        step = muffle.shares[i] * (muffle.before[i] - then[at])
        then[at] += step
        internal_loss.push(engine, at, step)
        changed += step
    return changed


@only_with("muffle", otherwise=0.0)
def hidden_stretch(engine: "Engine", share: Floats, now: Floats, own_gain: float) -> float:
    """Part of sum M d u- that the masses of `share`, less by g under a patch, leave out: before the sweep, after
    `note`.
    """
    muffle, hidden = engine.effects.muffle, 0.0
    for i in range(muffle.places.shape[0]):
        at, g = muffle.places[i], float(muffle.shares[i])
        hidden += share[at] * g / (1.0 - g) * bend_at(engine.head, now, at, own_gain) * muffle.before[i]
    return hidden
