"""`cavity`: a second head on the other side, coupled by the air between the two.

The air is a spring between the heads' mean displacements: K = rho c^2 / (sigma depth) in rad^2/s^2, for air of density
rho and heads of sigma kg/m^2 (as in Rossing, Bork, Zhao and Fystrom, "Acoustics of snare drums", JASA 92, 1992). It is
taken at the present step: stable as long as both heads keep 2 K T^2 below their limit, which
`step_numbers.coefficients_at` sees to for the first head, `part_of` for the second. Both heads are of the same order.
Kernels: audio thread.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import AIR_KG_PER_M3, SOUND_M_PER_S
from drumstick.drum.membrane.heads import aligned, head_of, pickups_moved, pickups_on
from drumstick.drum.membrane.scheme import even_losses, scheme_of, tuned
from drumstick.drum.membrane.step_coefficients import StepCoefficients
from drumstick.drum.membrane.sweep import Head, sweep, take_laplacian
from drumstick.drum.membrane.terms import Terms
from drumstick.drum.output import stems
from drumstick.parameters.declare import number
from drumstick.parameters.drum import HEAD_KG_PER_M2, Drum
from realtime.kernels.jit import njit, only_with
from realtime.records import ABSENT, Float32, Record, Records, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building, Separation
    from drumstick.drum.engine import Engine
    from drumstick.parameters.scene import Scene


@dataclass(frozen=True)
class CavityTable:
    """A second head on the other side, coupled by the air between."""

    depth_m: float = number(0.3, 0.02, 2.0, "m", "Distance between the heads")
    head_kg_per_m2: float = number(HEAD_KG_PER_M2, 0.05, 2.0, "kg/m^2", "Both heads' mass per area")
    f01_Hz: float = number(
        180.0,
        20.0,
        2000.0,
        "Hz",
        "Pitch of the second head alone",
        wire="cavity.f01",
        scale="log",
        rebuilds=True,
    )
    t60_s: float = number(1.0, 0.02, 60.0, "s", "Decay of the second head alone")
    heard: float = number(0.5, 0.0, 1.0, "1", "How much of the second head the pickups hear")


TABLE = CavityTable
# Of the first head's pitch. A head of half its pitch has four times its junctions.
_LOWEST = 0.5
Floats = npt.NDArray[np.float32]


def mistakes(table: CavityTable, drum: Drum) -> Iterator[tuple[str, str]]:
    """A second head so low that it would have far more junctions than the first: key and words."""
    least = _LOWEST * drum.f01_Hz
    if table.f01_Hz < least:
        yield (
            "f01_Hz",
            f"{table.f01_Hz:g} Hz is less than half of drum.f01_Hz ({drum.f01_Hz:g} Hz), which takes too large a mesh: "
            f"raise it to {least:g} Hz or more, or lower drum.f01_Hz",
        )


def spring(table: CavityTable, step_s: float) -> float:
    """K T^2."""
    stiffness = AIR_KG_PER_M3 * SOUND_M_PER_S**2
    return stiffness / (table.head_kg_per_m2 * table.depth_m) * step_s**2


class CavityState(Record):
    """Sums of u over the heads, gains that turn a difference of means into a push, the second head's own gains: of u,
    of u-, and in the fourth order of A u and A A u, as `Control` has them.
    """

    sum_1: float
    sum_2: float
    per_area_1: float
    per_area_2: float
    push_1: float
    push_2: float
    u_gain: Float32
    u_old_gain: Float32
    order_2: Float32
    order_4: Float32


STATE = dtype_of(CavityState)


class Cavity(NamedTuple):
    """The second head, state (1,) of STATE, and where it is heard: as the engine's own pickups; laplacian likewise."""

    head: Head
    state: Rows[CavityState]
    pickups: npt.NDArray[np.int64]
    pickup_gains: Floats
    laplacian: Any = ABSENT  # Floats, or None: what compiled code decides by


def part_of(building: "Building") -> Cavity:
    """The second head, and the air between."""
    lattice, numbers, step_s = building.lattice, building.numbers, building.step_s
    table = building.scene.drum.effects["cavity"]
    losses, order_4 = even_losses(table.t60_s, step_s), numbers.scheme.order_4
    scheme = scheme_of(lattice.topology, 4 if order_4 else 2, False).squeezed(4.0 - 2.0 * numbers.spring)
    own = StepCoefficients(losses, numbers.spring, scheme)
    second = tuned(table.f01_Hz, step_s, scheme, losses)
    head = head_of(second, own.weight_scale)
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    fields["per_area_1"], fields["per_area_2"] = 1.0 / lattice.area, 1.0 / second.area
    # A push f moves a junction of weight 1 / neighbours by f times what is baked into the weights, over the neighbours.
    fields["push_1"] = (
        numbers.spring * lattice.topology.neighbours / (numbers.weight_scale * numbers.loss_divisor)
    )
    fields["push_2"] = numbers.spring * lattice.topology.neighbours / (own.weight_scale * own.loss_divisor)
    for name, gain in own.gains().items():
        fields[name] = gain
    pickups, gains = pickups_on(building.scene, head, table.heard)
    return Cavity(head, state, pickups, gains, aligned((second.weights.size,)) if order_4 else ABSENT)


@only_with("cavity")
def head_push(engine: "Engine") -> Any:
    """f for the first head; None without a second one."""
    state: CavityState = engine.effects.cavity.state[0]
    state_difference = state.per_area_2 * state.sum_2 - state.per_area_1 * state.sum_1
    return np.float32(state.push_1 * state_difference)


@njit()
def _swept(cavity: Cavity, u: Floats, u_old: Floats, push: np.float32) -> float:
    # The second head's u+, into `u_old`, and its sum.
    state = cavity.state[0]
    terms = Terms(
        u_gain=state.u_gain,
        u_old_gain=state.u_old_gain,
        neighbour_gain=None,
        push=push,
        momentum=None,
        rho=None,
        eta=None,
        extra=None,
        extra_gain=None,
        total=1,
    )
    return sweep(cavity.head, u, u_old, terms)


@only_with("laplacian", otherwise=0.0)
def _swept_fourth(cavity: Cavity, u: Floats, u_old: Floats, push: np.float32) -> float:
    state = cavity.state[0]
    take_laplacian(cavity.head, u, cavity.laplacian)
    terms = Terms(
        u_gain=state.order_2,
        u_old_gain=state.u_old_gain,
        neighbour_gain=state.order_4,
        push=push,
        momentum=None,
        rho=None,
        eta=None,
        extra=u,
        extra_gain=state.u_gain,
        total=1,
    )
    return sweep(cavity.head, cavity.laplacian, u_old, terms)


@only_with("cavity")
def sweep_beside(engine: "Engine", present_level: int, total: float) -> None:
    """The second head's step; total: the sum of the first head's u+."""
    cavity: Cavity = engine.effects.cavity
    state = cavity.state[0]
    difference = state.per_area_1 * state.sum_1 - state.per_area_2 * state.sum_2
    time_levels = cavity.head.time_levels
    u, u_old = time_levels[present_level], time_levels[1 - present_level]
    push = np.float32(state.push_2 * difference)
    if cavity.laplacian is None:  # decided by the type, at compile time
        state.sum_2 = _swept(cavity, u, u_old, push)
    else:
        state.sum_2 = _swept_fourth(cavity, u, u_old, push)
    state.sum_1 = total


@only_with("cavity")
def second_moved(engine: "Engine", changed: float) -> None:
    """Add to the sum of the second head's u+."""
    state: CavityState = engine.effects.cavity.state[0]
    state.sum_2 += changed


@only_with("cavity")
def asked_sum(engine: "Engine") -> Any:
    """The air asks for the sum of the first head's u+."""
    return 1


@only_with("cavity", otherwise=(0.0, 0.0))
def picked_up(engine: "Engine", present_level: int) -> tuple[float, float]:
    """Pickups' signal of the second head, after its step."""
    cavity: Cavity = engine.effects.cavity
    now, after = cavity.head.time_levels[present_level], cavity.head.time_levels[1 - present_level]
    left, right = 0.0, 0.0
    for i in range(cavity.pickups.shape[0]):
        moved = float(after[cavity.pickups[i]] - now[cavity.pickups[i]])
        left += cavity.pickup_gains[i, 0] * moved
        right += cavity.pickup_gains[i, 1] * moved
        stems.add_second(engine, i, moved)
    return left, right


def moved(part: Cavity, scene: "Scene", half: int) -> Cavity:
    """The part as pickups hear it that are moved to the scene's places."""
    level = scene.drum.effects["cavity"].heard
    pickups, gains = pickups_moved(scene, part.head, level, part.pickups, half)
    return part._replace(pickups=pickups, pickup_gains=gains)


def separated(part: Cavity, separation: "Separation") -> tuple[Cavity, dict[str, Any]]:
    """The part as the mix hears it without what has a pair of its own, and that pair's gains."""
    own, kept = separation.of_corners(part.pickup_gains)
    return part._replace(pickup_gains=kept), {"second": own}


@only_with("cavity")
def reset(engine: "Engine") -> None:
    """All at rest."""
    cavity: Cavity = engine.effects.cavity
    cavity.head.time_levels[:] = np.float32(0.0)
    cavity.state[0].sum_1 = 0.0
    cavity.state[0].sum_2 = 0.0
