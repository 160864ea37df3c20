"""`muffle`: patches of gel or felt on the head, each damping what is under it; `press` can be set live.

On a mesh those are junctions. With s the head's loss, s_m the patch's and p how hard it is pressed, u- a junction's
value before the step and u+ the one after it without the patch, the step ends at u+ + g (u- - u+), where g = p s_m/(1 +
s + p s_m). The damper is centred in the step, so it only removes energy, however strong it is and however it changes
from step to step. Others compute with g in advance (the masses that a tension counts, the patch under a mallet's tip),
so g changes only at the beginning of a step, and only while no mallet is pressed in (of a mesh).

On a bank of modes the patches add to each mode's loss, in its coefficients (drumstick.drum.modal.held): no cost a
sample. Kernels: audio thread. `target`: written by the thread that receives it.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import internal_loss
from drumstick.drum.membrane.scheme import even_losses
from drumstick.drum.membrane.sweep import laplacian_at
from drumstick.parameters.declare import number, numbers
from realtime.kernels.jit import njit, only_with
from realtime.records import ABSENT, Record, Records, Rows, dtype_of, is_there

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class MuffleTable:
    """Gel, felt or a hand on the head, damping it. On a bank of modes to first order: each mode by itself, which holds
    for light patches."""

    patches: tuple[tuple[float, ...], ...] = numbers(
        ((0.75, 0.0, 0.15),), 3, -1.0, 1.0, "of the radius", "Patches, each [x, y, radius]"
    )
    t60_s: float = number(
        0.05,
        0.001,
        60.0,
        "s",
        "Time in which the head under a patch would lose 60 dB by the patch alone, at press 1",
    )
    press: float = number(
        1.0,
        0.0,
        1.0,
        "1",
        "How hard the patches press on the head: 0 is off",
        symbol="p",
        wire="muffle",
    )


TABLE = MuffleTable
ON_MODES = True
_WHOLE_WAY_S = 0.02  # from free to fully pressed: without a click, and quick enough for a hand that mutes


Floats = npt.NDArray[np.float32]


class LiveTargets(Record):
    """Values set while it plays, by wire name."""

    muffle: float


class MuffleState(Record):
    """p and g as they are; s_m of full pressure, 1 + s of the head, the most that p moves in a step, and whether it
    moves in this one. On a bank of modes g and s_m are 0.
    """

    press: float
    g: float
    s: float
    loss_divisor: float
    most: float
    moved: int


TARGETS, STATE = dtype_of(LiveTargets), dtype_of(MuffleState)


class Muffle(NamedTuple):
    """target, state: (1,). Of a mesh, shapes (n,): the junctions under patches, their masses as the tension counts
    them, and the u- that the sweep overwrites."""

    target: Rows[LiveTargets]
    state: Rows[MuffleState]
    places: npt.NDArray[np.int64] = ABSENT
    masses: Floats = ABSENT
    before: Floats = ABSENT


def damping_patches(table: MuffleTable) -> tuple[tuple[tuple[float, ...], ...], float]:
    """The patches, and their t60 at press 1."""
    return table.patches, table.t60_s


def _on_modes(table: MuffleTable, step_s: float) -> Muffle:
    # Free, as the bank is laid out: it is pressed when the head is struck first.
    target: Records = np.zeros(1, TARGETS)
    target["muffle"] = table.press
    state: Records = np.zeros(1, STATE)
    state[0] = (0.0, 0.0, 0.0, 1.0, step_s / _WHOLE_WAY_S, 0)
    return Muffle(target, state)


def part_of(building: "Building") -> Muffle:
    """The junctions under the scene's patches; a bank has them in its modes."""
    table: MuffleTable = building.scene.drum.effects["muffle"]
    lattice, numbers, step_s = building.lattice, building.numbers, building.step_s
    if not is_there(lattice):
        return _on_modes(table, step_s)
    rows, columns = np.nonzero(lattice.weights)
    at = np.array([lattice.position(int(r), int(c)) for r, c in zip(rows, columns, strict=True)])
    under = np.zeros(len(at), bool)
    for x, y, radius in table.patches:
        under |= np.hypot(at[:, 0] - x, at[:, 1] - y) <= abs(radius)
    places = (rows * lattice.weights.shape[1] + columns)[under].astype(np.int64)
    masses = (1.0 / (lattice.topology.neighbours * lattice.weights.ravel()[places])).astype(np.float32)
    s = even_losses(table.t60_s, step_s).s
    target: Records = np.zeros(1, TARGETS)
    target["muffle"] = table.press
    state: Records = np.zeros(1, STATE)
    loss_divisor = 1.0 + numbers.losses.s
    state[0] = (
        table.press,
        share_held(table.press, s, loss_divisor),
        s,
        loss_divisor,
        step_s / _WHOLE_WAY_S,
        0,
    )
    return Muffle(target, state, places, masses, np.zeros(len(places), np.float32))


@njit()
def share_held(press: float, s: float, loss_divisor: float) -> float:
    """g of patches pressed so hard."""
    return press * s / (loss_divisor + press * s)


@only_with("mallets", otherwise=False)
def _is_touched(engine: "Engine") -> bool:
    tips, touched = engine.mallets.tips, False
    for slot in range(tips.shape[0]):
        touched = touched or tips[slot].depth > 0.0 or tips[slot].depth_before > 0.0
    return touched


@njit()
def _move(engine: "Engine", most: float) -> None:
    muffle: Muffle = engine.effects.muffle
    state, target = muffle.state[0], muffle.target[0].muffle
    if state.press != target:
        way = target - state.press
        state.press = target if abs(way) <= most else state.press + math.copysign(most, way)
        state.g = share_held(state.press, state.s, state.loss_divisor)
        state.moved = 1


@only_with("muffle")
def resume(engine: "Engine") -> None:
    """Take up at once what was set while nothing sounded: no tip lies on the head yet."""
    state: MuffleState = engine.effects.muffle.state[0]
    state.moved = 0
    _move(engine, 1.0)


@only_with("muffle")
def before_sweep(engine: "Engine", u_old: Floats) -> None:
    """Move to the target, and keep u- where it will be needed, before the sweep."""
    muffle: Muffle = engine.effects.muffle
    muffle.state[0].moved = 0
    if muffle.state[0].press != muffle.target[0].muffle and not _is_touched(engine):
        _move(engine, muffle.state[0].most)
    for i in range(muffle.places.shape[0]):
        muffle.before[i] = u_old[muffle.places[i]]


@only_with("muffle")
def before_modes(engine: "Engine", steps: int) -> None:
    """Move towards the target, by as much as so many steps allow; tips that are pressed in are laid anew."""
    state: MuffleState = engine.effects.muffle.state[0]
    state.moved = 0
    _move(engine, state.most * steps)


@only_with("muffle", otherwise=False)
def is_moving(engine: "Engine") -> bool:
    """True while p is not yet what it was set to."""
    muffle: Muffle = engine.effects.muffle
    return bool(muffle.state[0].press != muffle.target[0].muffle)


@only_with("muffle", otherwise=0.0)
def press(engine: "Engine") -> float:
    """p."""
    state: MuffleState = engine.effects.muffle.state[0]
    return state.press


@only_with("muffle", otherwise=False)
def has_moved(engine: "Engine") -> bool:
    """True in a step in which g is another than before: whoever computes with it in advance does so again."""
    state: MuffleState = engine.effects.muffle.state[0]
    return bool(state.moved != 0)


@only_with("muffle")
def held_junctions(engine: "Engine") -> Any:
    """Junctions under patches."""
    return engine.effects.muffle.places


@only_with("muffle", otherwise=0.0)
def held_share(engine: "Engine") -> float:
    """g."""
    state: MuffleState = engine.effects.muffle.state[0]
    return state.g


@only_with("muffle", otherwise=0.0)
def after_sweep(engine: "Engine", u_new: Floats) -> float:
    """Brake the patches' junctions, after the sweep; returns by how much the sum of u+ changed."""
    changed = 0.0
    muffle: Muffle = engine.effects.muffle
    g = np.float32(muffle.state[0].g)
    for i in range(muffle.places.shape[0]):
        at = muffle.places[i]
        step = g * (muffle.before[i] - u_new[at])
        u_new[at] += step
        internal_loss.pushed(engine, at, step)
        changed += step
    return changed


@only_with("muffle", otherwise=0.0)
def hidden_stretch(engine: "Engine", u: Floats, own_gain: float) -> float:
    """Part of sum M d u- that the masses of the tension's share, less by g under a patch, leave out: before the sweep,
    after `before_sweep`.
    """
    muffle: Muffle = engine.effects.muffle
    hidden = 0.0
    for i in range(muffle.places.shape[0]):
        hidden += (
            muffle.masses[i] * laplacian_at(engine.head, u, muffle.places[i], own_gain) * muffle.before[i]
        )
    return muffle.state[0].g * hidden
