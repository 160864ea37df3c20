"""`rim`: the hoop answers to what strikes it, and a little to what strikes near it.

A thin ring's bending modes, n = 2 .. 7, at n (n^2 - 1)/sqrt(n^2 + 1) to each other (Love, "A treatise on the
mathematical theory of elasticity", art. 293), each a damped resonator that the blow drives. They are heard beside the
head and do not act on it.

A mallet that comes down near the rim meets both at once, the hoop with its shaft and the head with its tip, as in a rim
shot: what lies on the hoop is a share of its mass, and the head gets the rest of it. Both have the strike's speed, and
the hoop throws its part back as fast as it came, so no energy is made: (1 - share) m v^2/2 is the head's. Kernels:
audio thread.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drumstick.parameters.declare import number
from realtime.kernels.jit import only_with
from realtime.records import Record, Records, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class RimTable:
    """The hoop answers to strokes on the rim, and a little to those near it."""

    f_Hz: float = number(700.0, 50.0, 8000.0, "Hz", "Pitch of its lowest mode")
    t60_s: float = number(0.12, 0.005, 10.0, "s", "Decay of its lowest mode")
    level: float = number(
        0.6, 0.0, 4.0, "1", "Loudness of a full stroke on the rim, relative to one on the head"
    )
    width: float = number(0.1, 0.01, 0.5, "radii", "How far inside the rim a stroke still sounds the hoop")


TABLE = RimTable
ON_MODES = True


class HoopMode(Record):
    """u+ = turn u - kept u- + drive F; what is heard is (u+ - u-)/2, scaled into `drive`."""

    turn: float
    kept: float
    drive: float
    now: float
    before: float


MODE = dtype_of(HoopMode)


class HoopState(Record):
    """The force on the hoop in this step, and how strokes reach it."""

    force: float
    gain: float
    width: float


STATE = dtype_of(HoopState)
# Bending modes of a ring, n = 2 .. 7, to the lowest.
RATIOS = tuple(n * (n * n - 1) / math.sqrt(n * n + 1) / (6.0 / math.sqrt(5.0)) for n in range(2, 8))


class Rim(NamedTuple):
    """modes (m,) of MODE; state (1,) of STATE."""

    modes: Rows[HoopMode]
    state: Rows[HoopState]


_HIGHEST = 0.4  # of the mesh's rate: where modes of the rim end


def part_of(building: "Building") -> Rim:
    """The hoop's modes within the mesh's reach; each rings as many periods as the lowest, and is struck the weaker the
    higher it is."""
    step_s = building.step_s
    table = building.scene.drum.effects["rim"]
    ratios = [ratio for ratio in RATIOS if ratio * table.f_Hz * step_s < _HIGHEST]
    modes: Records = np.zeros(max(len(ratios), 1), MODE)
    for mode, ratio in zip(modes, ratios, strict=False):
        left = 10.0 ** (-3.0 * step_s * ratio / table.t60_s)
        mode["turn"] = 2.0 * left * math.cos(2.0 * math.pi * ratio * table.f_Hz * step_s)
        mode["kept"] = left * left
        mode["drive"] = 0.5 / ratio / sum(1.0 / other for other in ratios)
    state: Records = np.zeros(1, STATE)
    state["width"] = table.width
    return Rim(modes, state)


def set_level(rim: Rim, table: RimTable, peak: float, blow: float) -> None:
    """Let a full stroke on the rim peak at most at its level times `peak`. blow: its impulse, N steps, as it is heard.

    The modes share it.
    """
    rim.state["gain"] = table.level * peak / blow


@only_with("rim")
def begin_step(engine: "Engine") -> None:
    """Clear the hoop's share before this step's forces."""
    state: HoopState = engine.effects.rim.state[0]
    state.force = 0.0


@only_with("rim", otherwise=0.0)
def taken_share(engine: "Engine", x: float, y: float) -> float:
    """Share of a blow at (x, y), in radii, that the hoop gets: all from the rim on, none further in than `width`."""
    state: HoopState = engine.effects.rim.state[0]
    width = state.width
    return min(max((math.hypot(x, y) - (1.0 - width)) / width, 0.0), 1.0)


@only_with("rim")
def struck(engine: "Engine", x: float, y: float, impulse: float) -> None:
    """A blow of so much impulse, N steps, at (x, y).

    Wood on metal is over within a step, however long the head is touched: the hoop gets its share of it at once.
    """
    state: HoopState = engine.effects.rim.state[0]
    state.force += impulse * taken_share(engine, x, y)


@only_with("rim", otherwise=0.0)
def added_output(engine: "Engine") -> float:
    """One step of the hoop, and what is heard of it."""
    rim: Rim = engine.effects.rim
    state, total = rim.state[0], 0.0
    for i in range(rim.modes.shape[0]):
        mode = rim.modes[i]
        after = mode.turn * mode.now - mode.kept * mode.before + mode.drive * state.force
        total += after - mode.before
        mode.before = mode.now
        mode.now = after
    return state.gain * total


@only_with("rim")
def reset(engine: "Engine") -> None:
    """All at rest."""
    rim: Rim = engine.effects.rim
    for i in range(rim.modes.shape[0]):
        rim.modes[i].now = 0.0
        rim.modes[i].before = 0.0
