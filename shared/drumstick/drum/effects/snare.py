"""`snare`: wires across the second head, which leave it and fall back on it while it rings.

Each wire is a few beads on springs, pressed against the head. A bead and the head that come as near as eta = u - x push
each other by F = K [eta + eta_0]+, less what they push at rest, F_0 = K eta_0. In discrete time the push is the
discrete gradient of its energy between eta- and eta+ (Chatziioannou and van Walstijn, "Energy conserving schemes for
the simulation of musical instrument contact dynamics", J. Sound Vib. 339, 2015): one equation a bead with one solution,
and no blow, however hard, adds energy. Kernels: audio thread.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.interpolation import corners_of
from drumstick.drum.membrane.lattice import TOPOLOGIES
from drumstick.drum.membrane.scheme import even_losses
from drumstick.parameters.declare import count, number
from realtime.kernels.jit import njit, only_with
from realtime.records import Record, Records, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.effects.cavity import Cavity
    from drumstick.drum.effects.registry import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class SnareTable:
    """Wires across the second head, which rattle on it. Needs `cavity`, whose head they lie on."""

    wires: int = count(12, 1, 40, "wires", "Side by side across the head")
    f_Hz: float = number(300.0, 20.0, 2000.0, "Hz", "Pitch of a wire by itself")
    t60_s: float = number(0.08, 0.005, 10.0, "s", "Its own decay")
    mass: float = number(0.08, 0.001, 1.0, "of the head", "Of all wires together")
    press: float = number(
        0.1,
        0.0,
        2.0,
        "1",
        "How firmly the wires press on the head: their deflection, as a share of the snare head's largest "
        "movement after a full-scale stroke at half radius",
    )


TABLE = SnareTable
NEEDS = ("cavity", "the wires lie on the second head")


class Bead(Record):
    """One bead: the junction under it, its place and how near the head is to it, now and before."""

    junction: int
    now: float
    before: float
    eta: float
    eta_before: float


BEAD = dtype_of(Bead)


class WiresState(Record):
    """K and eta_0; a bead's mass in junctions, its spring (w T)^2, 1 + its losses; what a weight of 1, as baked, gives
    way.
    """

    stiffness: float
    eta_0: float
    mass: float
    spring: float
    loss: float
    give: float


STATE = dtype_of(WiresState)


class Snare(NamedTuple):
    """beads (n,) of BEAD; state (1,) of STATE."""

    beads: Rows[Bead]
    state: Rows[WiresState]


# Where wires lie on the second head, in radii, and the beads that each of them is.
_WIRE_LENGTH, _BED_WIDTH, _BEADS = 0.85, 0.12, 5


def part_of(building: "Building") -> Snare:
    """The wires, along x, side by side about the middle of the second head. `calibrate` presses them on."""
    under: Cavity = building.parts["cavity"]
    step_s = building.step_s
    table = building.scene.drum.effects["snare"]
    wires: int = table.wires
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    held_back = 2.0 / (1.0 + float(under.state["then_gain"][0]))
    tau = 2.0 - float(under.state["now_gain"][0]) * held_back
    neighbours = TOPOLOGIES[building.scene.mesh.topology].neighbours
    junctions = 1.0 / float(under.state["per_area_2"][0])
    along = np.linspace(-_WIRE_LENGTH, _WIRE_LENGTH, _BEADS)
    across = np.linspace(-_BED_WIDTH, _BED_WIDTH, wires) if wires > 1 else np.zeros(1)
    places = [corners_of(under.head, float(x), float(y)) for y in across for x in along]
    # One bead a junction: two on the same would each be solved for without the other.
    under_beads = np.unique([corners[int(np.argmax(shares))] for corners, shares in places])
    beads: Records = np.zeros(len(under_beads), BEAD)
    beads["junction"] = under_beads
    fields["mass"] = table.mass * junctions / len(beads)
    fields["spring"] = min((2.0 * math.pi * table.f_Hz * step_s) ** 2, 2.0)
    fields["loss"] = 1.0 + even_losses(table.t60_s, step_s).s
    fields["give"] = neighbours / tau
    # As stiff as a step still shows: a bead and a junction in touch swing at a radian a step.
    fields["stiffness"] = 1.0 / (1.0 + 1.0 / fields["mass"])
    return Snare(beads, state)


@njit()
def met(before: float, free: float, give: float) -> float:
    """eta+ = free - give [eta-, eta+], where give is K/2 times all that gives way, and [ , ] the gradient over K/2:
    the sum of both in touch, 0 of both apart, else the square of the one in touch over their difference."""
    both = (free - give * before) / (1.0 + give)
    if before >= 0.0 and both >= 0.0:
        return both
    if before < 0.0 and free < 0.0:
        return free
    if before >= 0.0:  # leaving: (eta+ - free)(before - eta+) + give before^2 = 0, the lower root
        half = 0.5 * (free + before)
        return half - math.sqrt(0.25 * (before - free) ** 2 + give * before * before)
    # Coming: (eta+ - free)(eta+ - before) + give eta+^2 = 0, the upper root.
    half = 0.5 * (free + before) / (1.0 + give)
    return half + math.sqrt(max(half * half - free * before / (1.0 + give), 0.0))


@only_with("snare", otherwise=0.0)
def rattle(engine: "Engine", head_after: npt.NDArray[np.float32]) -> float:
    """Move the beads on after the second head's sweep: they push it and are pushed; returns by how much its sum
    changed.
    """
    state, beads = engine.effects.snare.state[0], engine.effects.snare.beads
    weights = engine.effects.cavity.head.weights
    changed = 0.0
    at_rest = state.stiffness * state.eta_0
    for i in range(beads.shape[0]):
        bead = beads[i]
        give = weights[bead.junction] * state.give
        # Without the push: the head's and the bead's next places, with the constant push of rest on both.
        base = (2.0 - state.spring) * bead.now - (2.0 - state.loss) * bead.before
        free = (base - at_rest / state.mass) / state.loss
        height = float(head_after[bead.junction]) + give * at_rest
        all_gives = 0.5 * state.stiffness * (give + 1.0 / (state.mass * state.loss))
        eta = met(bead.eta_before + state.eta_0, height - free + state.eta_0, all_gives) - state.eta_0
        force = (height - free - eta) / (give + 1.0 / (state.mass * state.loss))
        step = give * (at_rest - force)
        head_after[bead.junction] += np.float32(step)
        changed += step
        bead.before = bead.now
        bead.now = free + force / (state.mass * state.loss)
        bead.eta_before = bead.eta
        bead.eta = (
            float(head_after[bead.junction]) - bead.now
        )  # as the plane has it, so that rounding adds up nowhere
    return changed


@only_with("snare")
def reset(engine: "Engine") -> None:
    """All at rest, in touch with the head."""
    for i in range(engine.effects.snare.beads.shape[0]):
        bead = engine.effects.snare.beads[i]
        bead.now = 0.0
        bead.before = 0.0
        bead.eta = 0.0
        bead.eta_before = 0.0
