"""`snare`: wires across the second head, which leave it and fall back on it while it rings; `strainer` can be set live.

Each wire is a string of its own along a row of the head's junctions (after Bilbao, "Time domain simulation and sound
synthesis for the snare drum", J. Acoust. Soc. Am. 131, 2012, where a wire meets the head all along its length). With x
a string's height and u the head's, a step of a point of mass M is

    (1 + s) x+ = 2 x - (1 - s) x- + l^2 (x left - 2 x + x right) + (F - F_0)/M        l = c T/h <= 1, ends at rest

and the head under it gets -(F - F_0). A wire and the head that come as near as eta = u - x push each other by F = K
[eta + eta_0]+, at rest by F_0 = K [eta_0]+. Below 0, on the way to off, -eta_0 is a gap. In discrete time F is the
discrete gradient of its energy between eta- and eta+ (Chatziioannou and van Walstijn, "Energy conserving schemes for
the simulation of musical instrument contact dynamics", J. Sound Vib. 339, 2015), so that a contact never adds energy,
however hard the blow. Each junction lies under at most one point: the equations are solved one by one, and each has
exactly one solution. Turning the strainer is work from outside, and with heavy wires under a strong pull not little.

K/M does not follow the mesh: a wire on a rigid support would oscillate at 6 kHz, which the discrete step turns into 4.2
kHz at 24 kHz, 5.4 at 48. Kernels: audio thread. `target`: written by the thread that receives it.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import TOPOLOGIES
from drumstick.drum.membrane.scheme import even_losses
from drumstick.parameters.declare import count, number
from realtime.kernels.jit import njit, only_with
from realtime.records import Record, Records, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.effects.cavity import Cavity
    from drumstick.drum.engine import Engine
    from drumstick.drum.membrane.sweep import Head


@dataclass(frozen=True)
class SnareTable:
    """Wires across the second head, which rattle on it. Needs `cavity`, whose head they lie on."""

    wires: int = count(12, 1, 42, "wires", "Number of wires, side by side across the head")
    g_per_m: float = number(
        2.2, 0.1, 50.0, "g/m", "Mass of one wire: 5 for a coil of 0.4 mm steel, 1.6 mm wide; gut has 1"
    )
    tension_N: float = number(3.3, 0.1, 200.0, "N", "Pull on one wire with the strainer tight")
    bed_mm: float = number(
        0.1, 0.0, 10.0, "mm", "How far the snare bed bends the wires, which presses them on the head"
    )
    t60_s: float = number(0.14, 0.005, 10.0, "s", "A wire's own decay")
    strainer: float = number(
        1.0, 0.0, 1.0, "1", "How tight the strainer is; 0 is off: the wires hang free", wire="strainer"
    )


TABLE = SnareTable
NEEDS = ("cavity", "the wires lie on the second head")


def is_in_metres(table: SnareTable) -> bool:
    """Wires lie and hang so many metres from the head."""
    return True


# Half the length of the wires and half the width of the bed, in radii; how far from the head wires hang; the pitch of a
# wire on something rigid; the least pull, of that of a tight strainer; time from tight to loose, and from there to off.
_HALF_LENGTH, _HALF_WIDTH, _GAP_M, _CONTACT_HZ, _LEAST, _WHOLE_WAY_S = 0.85, 0.2, 0.005, 6000.0, 0.1, 0.05
_OFF = -1.0

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]


class LiveTargets(Record):
    """Values set while it plays, by wire name."""

    strainer: float


class WiresState(Record):
    """tight: from 1 to 0, and to -1 where the wires are off; most: how far it may move in a step. stiffness: K; mass: M
    in junctions; spring: l^2, and eta_0, of a tight strainer; gap: of one that is off; loss: 1 + s of a wire;
    head_compliance: times a junction's weight, how far a push of 1 moves it in a step; apart: junctions from point to
    point.
    """

    tight: float
    most: float
    stiffness: float
    mass: float
    spring: float
    eta_0: float
    gap: float
    loss: float
    head_compliance: float
    apart: int


TARGETS, STATE = dtype_of(LiveTargets), dtype_of(WiresState)


class Snare(NamedTuple):
    """target, state: (1,). places x and etas of S strings of P points, each (2, S, P + 2), the first index as in the
    head's time_levels; first and last column stay 0. first: the junction under each string's first point, (S,).
    """

    target: Rows[LiveTargets]
    state: Rows[WiresState]
    places: Doubles
    etas: Doubles
    first: npt.NDArray[np.int64]


def part_of(building: "Building") -> Snare:
    """The wires, along x, on rows of the second head about its middle. Where the bed has fewer rows than there are
    wires, each string stands for several. One so fast that it crosses half its length in a step is slowed.
    """
    under: Cavity = building.parts["cavity"]
    step_s, radius_m = building.step_s, building.scene.drum.radius_m
    drum = building.scene.drum
    table: SnareTable = drum.effects["snare"]
    grid, topology = under.head.grid[0], TOPOLOGIES[building.scene.mesh.topology]
    spacing, height = float(grid["spacing"]), topology.row_height
    rows_aside = int(_HALF_WIDTH / (height * spacing))
    strings = min(table.wires, 2 * rows_aside + 1)
    # One string a row: two on the same junction would each be solved for without the other.
    rows = (
        np.floor(np.linspace(-rows_aside, rows_aside, strings) + 0.5).astype(int)
        if strings > 1
        else np.zeros(1, int)
    )
    c_m_per_s = math.sqrt(table.tension_N / (1e-3 * table.g_per_m))
    length_m = 2.0 * _HALF_LENGTH * radius_m
    # As fine as the head, and no finer than a wave of the string goes in a step.
    apart = max(1, math.ceil(c_m_per_s * step_s / (spacing * radius_m)))
    pieces = max(int(2.0 * _HALF_LENGTH / (apart * spacing)), 2)
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    junction_kg = drum.effects["cavity"].head_kg_per_m2 * height * (spacing * radius_m) ** 2
    fields["mass"] = table.wires / strings * 1e-3 * table.g_per_m * length_m / pieces / junction_kg
    fields["spring"] = min((c_m_per_s * step_s * pieces / length_m) ** 2, 1.0)
    turn = 2.0 * math.pi * _CONTACT_HZ * step_s
    fields["stiffness"] = fields["mass"] * turn * turn
    # Bent by b over a length L, a string that is pulled by T presses with 8 b T/L^2.
    pressed_m = 8e-3 * table.bed_mm * (c_m_per_s / (length_m * 2.0 * math.pi * _CONTACT_HZ)) ** 2
    fields["eta_0"], fields["gap"] = pressed_m / building.unit_m, _GAP_M / building.unit_m
    fields["loss"] = 1.0 + even_losses(table.t60_s, step_s).s
    fields["head_compliance"] = under.state["push_2"][0] / building.numbers.spring
    fields["apart"] = apart
    fields["most"] = step_s / _WHOLE_WAY_S
    fields["tight"] = table.strainer if table.strainer > 0.0 else _OFF
    target: Records = np.zeros(1, TARGETS)
    target["strainer"] = table.strainer
    middle = int(grid["centre_column"])
    first = (int(grid["centre_row"]) + rows) * int(grid["stride"]) + middle - (pieces // 2 - 1) * apart
    shape = (2, len(rows), pieces + 1)
    return Snare(target, state, np.zeros(shape), np.zeros(shape), first)


@njit()
def solve_overlap(before: float, free: float, k: float) -> float:
    """eta+ = free - k ([eta+]+^2 - [eta-]+^2)/(eta+ - eta-), k: K/2 times all compliances."""
    both = (free - k * before) / (1.0 + k)
    if before >= 0.0 and both >= 0.0:
        return both
    if before < 0.0 and free < 0.0:
        return free
    if before >= 0.0:  # leaving: (eta+ - free)(before - eta+) + k before^2 = 0, the lower root
        half = 0.5 * (free + before)
        return half - math.sqrt(0.25 * (before - free) ** 2 + k * before * before)
    # Coming: (eta+ - free)(eta+ - before) + k eta+^2 = 0, the upper root.
    half = 0.5 * (free + before) / (1.0 + k)
    return half + math.sqrt(max(half * half - free * before / (1.0 + k), 0.0))


@njit()
def eta_0_of(state: WiresState) -> float:
    """eta_0 as the strainer stands; below 0 it is a gap."""
    return state.tight * (state.eta_0 if state.tight > 0.0 else state.gap)


@njit()
def spring_of(state: WiresState) -> float:
    """l^2 as the strainer stands."""
    return state.spring * max(state.tight, _LEAST)


@only_with("snare", otherwise=0.0)
def on_second_head(engine: "Engine", present_level: int) -> float:
    """Move the wires on after the second head's sweep: they push it and are pushed; returns by how much its sum
    changed. present_level: which of the head's two is u.
    """
    snare: Snare = engine.effects.snare
    state = snare.state[0]
    if state.tight <= _OFF:
        return 0.0
    head: Head = engine.effects.cavity.head
    weights, head_after = head.weights, head.time_levels[1 - present_level]
    now, coming = snare.places[present_level], snare.places[1 - present_level]
    eta = snare.etas[1 - present_level]
    spring, eta_0, loss = spring_of(state), eta_0_of(state), state.loss
    lifted = 2.0 * max(eta_0, 0.0)
    own = 1.0 / (state.mass * loss)
    changed = 0.0
    for string in range(now.shape[0]):
        at = snare.first[string]
        for k in range(1, now.shape[1] - 1):
            head_compliance = float(weights[at]) * state.head_compliance
            compliance = head_compliance + own
            stiff = 0.5 * state.stiffness * compliance
            # Without F - F_0: the wire's next place, and how near the head comes to it.
            pulled = spring * (now[string, k - 1] + now[string, k + 1] - 2.0 * now[string, k])
            alone = (2.0 * now[string, k] - (2.0 - loss) * coming[string, k] + pulled) / loss
            bare = float(head_after[at]) - alone
            before = eta[string, k]
            # In touch before and after eta_0 drops out: what rounding leaves of a large one would never fall asleep.
            near = (bare - stiff * before) / (1.0 + stiff)
            if eta_0 < 0.0 or before + eta_0 < 0.0 or near + eta_0 < 0.0:
                near = solve_overlap(before + eta_0, bare + stiff * lifted + eta_0, stiff) - eta_0
            push = (bare - near) / compliance
            step = np.float32(-head_compliance * push)
            head_after[at] += step
            changed += float(step)
            coming[string, k] = alone + own * push
            # As the head has it, so that rounding adds up nowhere.
            eta[string, k] = float(head_after[at]) - coming[string, k]
            at += state.apart
    return changed


@njit()
def _hang(engine: "Engine") -> None:
    snare: Snare = engine.effects.snare
    snare.places[:] = 0.0
    snare.etas[:] = 0.0


@njit()
def _turn(engine: "Engine", most: float) -> None:
    snare: Snare = engine.effects.snare
    state, target = snare.state[0], snare.target[0].strainer
    goal = min(target, 1.0) if target > 0.0 else _OFF
    if state.tight != goal:
        state.tight += min(max(goal - state.tight, -most), most)
        if state.tight <= _OFF:
            _hang(engine)


@only_with("snare")
def before_sweep(engine: "Engine", u_old: Floats) -> None:
    """Turn the strainer towards its target."""
    _turn(engine, engine.effects.snare.state[0].most)


@only_with("snare")
def resume(engine: "Engine") -> None:
    """Take up at once what was set while nothing sounded."""
    _turn(engine, 2.0)


@only_with("snare")
def reset(engine: "Engine") -> None:
    """All at rest."""
    _hang(engine)
