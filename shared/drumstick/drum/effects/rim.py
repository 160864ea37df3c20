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
from typing import TYPE_CHECKING, NamedTuple

from realtime.kernels.jit import only_with
from realtime.records import Record, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine


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


@only_with("rim")
def begin(engine: "Engine") -> None:
    """Before this step's forces."""
    engine.rim.state[0].force = 0.0


@only_with("rim", otherwise=0.0)
def share(engine: "Engine", x: float, y: float) -> float:
    """What of a blow at (x, y), in radii, the hoop gets: all from the rim on, none further in than `width`."""
    width = engine.rim.state[0].width
    return min(max((math.hypot(x, y) - (1.0 - width)) / width, 0.0), 1.0)


@only_with("rim")
def strike(engine: "Engine", x: float, y: float, impulse: float) -> None:
    """A blow of so much impulse, N steps, at (x, y).

    Wood on metal is over within a step, however long the head is touched: the hoop gets its share of it at once.
    """
    engine.rim.state[0].force += impulse * share(engine, x, y)


@only_with("rim", otherwise=0.0)
def heard(engine: "Engine") -> float:
    """One step of the hoop, and what is heard of it."""
    state, total = engine.rim.state[0], 0.0
    for i in range(engine.rim.modes.shape[0]):
        mode = engine.rim.modes[i]
        after = mode.turn * mode.now - mode.kept * mode.before + mode.drive * state.force
        total += after - mode.before
        mode.before = mode.now
        mode.now = after
    return state.gain * total


@only_with("rim")
def rest(engine: "Engine") -> None:
    """All at rest."""
    for i in range(engine.rim.modes.shape[0]):
        engine.rim.modes[i].now = 0.0
        engine.rim.modes[i].before = 0.0
