"""`air`: each mode's air load and radiation, on both sides.

On a bank of modes it only sets the modes' pitches, decays and shapes (drumstick.drum.modal.air_load): no cost while
the drum plays. On a mesh the lowest modes get the same pitches and decays by a push on some of its junctions
(drumstick.drum.modal.air_on_mesh). Kernels: audio thread.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import internal_loss
from drumstick.drum.effects.building import MovedModes, Separation
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.membrane.sweep import laplacian_at
from drumstick.drum.output import stems
from drumstick.parameters.declare import choice, number
from drumstick.parameters.drum import HEAD_KG_PER_M2
from realtime.kernels.jit import njit, only_with
from realtime.records import ABSENT, is_there

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class AirTable:
    """Air on both sides of the head; f01_Hz includes it. On a mesh: the 13 lowest modes, and no microphones."""

    density_kg_per_m3: float = number(1.2, 0.0, 10.0, "kg/m^3", "Density of the air; 0: none")
    head_kg_per_m2: float = number(
        HEAD_KG_PER_M2, 0.05, 2.0, "kg/m^2", "Mass per area of the head alone; 0.26 is 0.19 mm of polyester"
    )
    baffle: Literal["endless", "none"] = choice(
        "endless",
        ("endless", "none"),
        "endless: an infinite baffle, the head's two sides do not cancel (timpani); none: their sound cancels round "
        "the rim, so low modes radiate less and ring longer (toms)",
    )
    bending_N_m: float = number(
        0.0,
        0.0,
        10.0,
        "N m",
        "Bending stiffness of the head, E h^3/(12 (1 - nu^2)): 0.19 mm of polyester has 0.0034, 0.25 mm 0.0077. It "
        "raises high modes, above some 3 kHz on a tom, and parts them; on a mesh the 13 lowest modes alone. 0: none",
    )


TABLE = AirTable
ON_MODES = True
MESH_PICKUPS_ONLY = "a mesh with air would have its lowest modes too loud at microphones"

Floats = npt.NDArray[np.float32]


class Air(NamedTuple):
    """The moved modes. amplitudes (2, N): a, and a-; gains (N,): their pushes; touched (P,), pushes (J,): this step's
    push on each place, and on each junction."""

    moved: MovedModes
    amplitudes: Floats
    gains: Floats
    touched: Floats
    pushes: Floats


def part_of(building: "Building") -> Air:
    """The mesh's modes at rest; None for a bank of modes, and without air."""
    moved = building.moved
    if not is_there(moved):
        return ABSENT
    return Air(
        moved=moved,
        amplitudes=np.zeros((2, len(moved.loss)), np.float32),
        gains=np.zeros(len(moved.loss), np.float32),
        touched=np.zeros(len(moved.places), np.float32),
        pushes=aligned((building.lattice.weights.size,)),
    )


@njit(fastmath={"contract", "reassoc"})
def _product(values: Floats, others: Floats) -> float:
    total = np.float32(0.0)
    for i in range(others.shape[0]):
        total += values[i] * others[i]
    return float(total)


@njit(fastmath={"contract", "reassoc"})
def _measure(dual: Floats, heights: Floats, now: Floats) -> None:
    # Four modes at a time: each height is loaded once for them.
    for n in range(0, now.shape[0], 4):
        first, second, third, fourth = dual[n], dual[n + 1], dual[n + 2], dual[n + 3]
        a = b = c = d = np.float32(0.0)
        for i in range(heights.shape[0]):
            a += first[i] * heights[i]
            b += second[i] * heights[i]
            c += third[i] * heights[i]
            d += fourth[i] * heights[i]
        now[n], now[n + 1], now[n + 2], now[n + 3] = a, b, c, d


@njit(fastmath={"contract", "reassoc"})
def _push(dual: Floats, gains: Floats, pushes: Floats) -> None:
    pushes[:] = np.float32(0.0)
    for n in range(0, gains.shape[0], 4):
        first, second, third, fourth = dual[n], dual[n + 1], dual[n + 2], dual[n + 3]
        a, b, c, d = gains[n], gains[n + 1], gains[n + 2], gains[n + 3]
        for i in range(pushes.shape[0]):
            pushes[i] += a * first[i] + b * second[i] + c * third[i] + d * fourth[i]


@only_with("tension")
def _spread(engine: "Engine") -> None:
    air: Air = engine.effects.air
    for i in range(air.moved.places.shape[0]):
        air.pushes[air.moved.places[i]] = air.touched[i]


@only_with("air")
def before_sweep(engine: "Engine") -> None:
    """Find this step's push from the modes' amplitudes in u and u-."""
    air: Air = engine.effects.air
    u = engine.head.time_levels[engine.control[0].present_level]
    now, before, touched = air.amplitudes[0], air.amplitudes[1], air.touched
    for i in range(touched.shape[0]):
        touched[i] = u[air.moved.places[i]]
    before[:] = now
    _measure(air.moved.dual, touched, now)
    for n in range(now.shape[0]):
        air.gains[n] = _product(air.moved.stiffness[n], now) - air.moved.loss[n] * (now[n] - before[n])
    _push(air.moved.dual, air.gains, touched)
    _spread(engine)


@only_with("air", otherwise=0.0)
def after_sweep(engine: "Engine", u_new: Floats) -> float:
    """Push, before anything brakes u+; returns by how much its sum changed."""
    air: Air = engine.effects.air
    changed = 0.0
    for i in range(air.moved.places.shape[0]):
        at, step = air.moved.places[i], air.touched[i]
        u_new[at] += step
        internal_loss.pushed(engine, at, step)
        changed += step
    return changed


@only_with("air", otherwise=0.0)
def stretched(engine: "Engine", u: Floats, share: Floats, own_gain: float) -> float:
    """Amount that this step's push adds to the sum of share A u u+, as `tension` counts it."""
    air: Air = engine.effects.air
    total = 0.0
    for i in range(air.moved.places.shape[0]):
        at = air.moved.places[i]
        total += share[at] * laplacian_at(engine.head, u, at, own_gain) * air.touched[i]
    return total


@only_with("air")
def junction_pushes(engine: "Engine") -> Any:
    """Each junction's push in this step, (J,); None without air."""
    return engine.effects.air.pushes


@only_with("air", otherwise=(0.0, 0.0))
def picked_up(engine: "Engine") -> tuple[float, float]:
    """Signal that takes away what the pickups hear too much, a step late: all modes of the mesh have one mass."""
    air: Air = engine.effects.air
    left = right = 0.0
    for n in range(air.moved.heard.shape[1]):
        moved = air.amplitudes[0, n] - air.amplitudes[1, n]
        left -= air.moved.heard[0, n] * moved
        right -= air.moved.heard[1, n] * moved
        stems.add_moved(engine, n, moved)
    return left, right


def separated(part: Air, separation: Separation) -> tuple[Air, dict[str, Any]]:
    """The part as the mix hears it without what has a pair of its own, and that pair's gains."""
    own, kept = separation.split(separation.moved)
    return part._replace(moved=part.moved._replace(heard=kept)), {"moved": own}


@only_with("air")
def reset(engine: "Engine") -> None:
    """All at rest."""
    air: Air = engine.effects.air
    air.amplitudes[:] = 0.0
    air.touched[:] = np.float32(0.0)
    air.pushes[:] = np.float32(0.0)
