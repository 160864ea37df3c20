"""`sympathy`: the sound of other drums shakes the second head and the wires on it: buzz from a neighbour's strike.

What the neighbours play arrives later by the way through the air, as a pressure p that is the same all over the head
(its waves are longer than the head is wide up to some hundred Hz, where toms speak). p pushes the head as the air of
`cavity` does: a step moves it by T^2 p/sigma, for a head of sigma kg/m^2. So it is a force from outside, taken between
two steps: it does the work sum f (u+ - u-)/2, and whatever else the drum has keeps to the energy that it is given.

One way only. Whoever mixes lets a drum with `sympathy` hear those without, never another one with it: no loop, and no
gain or distance for which it could howl. `outside`: written by the audio thread before each block, at most 1.0, as the
neighbours would be heard by themselves; it stays silent where nobody writes there. Kernels: audio thread.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.engine import OUTSIDE_FRAMES
from drumstick.parameters.declare import number
from realtime.kernels.jit import only_with
from realtime.records import Record, Records, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.effects.cavity import Cavity
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class SympathyTable:
    """Other drums of the same sound server shake the second head, and the snare wires on it buzz. Needs `cavity`."""

    full_scale_Pa: float = number(
        20.0,
        0.0,
        200.0,
        "Pa",
        "Sound pressure at the second head when the other drums' sound is at full scale: how strongly they shake it",
    )
    distance_m: float = number(
        0.5, 0.0, 20.0, "m", "Distance of the other drums: their sound comes later by its way through the air"
    )


TABLE = SympathyTable
NEEDS = ("cavity", "the neighbours' sound shakes the second head")
_NEVER = -(1 << 62)

Floats = npt.NDArray[np.float32]


def is_in_metres(table: SympathyTable) -> bool:
    """True: a pressure moves the head by so many metres."""
    return True


class SympathyState(Record):
    """push: what full scale moves a junction by in a step, over its weight as baked; weights: their sum. heard: sum of
    the frames since the last step. In steps: the way, how many have been taken in, which of them the head comes to
    next, and the last that was not silent."""

    push: float
    weights: float
    heard: float
    way: int
    taken: int
    next: int
    last: int


STATE = dtype_of(SympathyState)


class Sympathy(NamedTuple):
    """state (1,); outside (1024,): the coming block of the neighbours' sound; line (L,): what is on its way."""

    state: Rows[SympathyState]
    outside: Floats
    line: Floats


def part_of(building: "Building") -> Sympathy:
    """At rest, as long as nobody writes to `outside`."""
    cavity: Cavity = building.parts["cavity"]
    drum = building.scene.drum
    table: SympathyTable = drum.effects["sympathy"]
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    step_s, sigma = building.step_s, drum.effects["cavity"].head_kg_per_m2
    per_acceleration = float(cavity.state["push_2"][0]) / building.numbers.spring
    fields["push"] = per_acceleration * step_s**2 * table.full_scale_Pa / (sigma * building.unit_m)
    fields["weights"] = float(cavity.head.weights.sum(dtype=np.float64))
    fields["way"] = round(table.distance_m / SOUND_M_PER_S / step_s)
    fields["last"] = _NEVER
    return Sympathy(
        state, np.zeros(OUTSIDE_FRAMES, np.float32), np.zeros(int(fields["way"]) + OUTSIDE_FRAMES, np.float32)
    )


@only_with("sympathy", otherwise=0)
def taken_in(engine: "Engine", frames: int) -> int:
    """Take in the neighbours' part of this block, the mean of its frames for each step; more than 0 while
    something of their sound is on its way."""
    sympathy: Sympathy = engine.effects.sympathy
    state, line, outside, control = sympathy.state[0], sympathy.line, sympathy.outside, engine.control[0]
    state.next = state.taken
    for i in range(frames):
        if i < outside.shape[0]:
            state.heard += outside[i]
        if (control.phase + i) % control.divisor == 0:
            line[state.taken % line.shape[0]] = state.heard / control.divisor
            if state.heard != 0.0:
                state.last = state.taken
            state.heard = 0.0
            state.taken += 1
    return 1 if state.last + state.way >= state.next else 0


@only_with("sympathy", otherwise=0.0)
def on_second_head(engine: "Engine", present_level: int) -> float:
    """Push the second head after its sweep, before the wires meet it; returns by how much its sum changed."""
    sympathy: Sympathy = engine.effects.sympathy
    state = sympathy.state[0]
    push = np.float32(state.push * sympathy.line[(state.next - state.way) % sympathy.line.shape[0]])
    state.next += 1
    if push == 0.0:
        return 0.0
    cavity: Cavity = engine.effects.cavity
    weights, head_after = cavity.head.weights, cavity.head.time_levels[1 - present_level]
    for i in range(weights.shape[0]):
        head_after[i] += push * weights[i]
    return float(push) * state.weights
