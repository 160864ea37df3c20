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
from typing import Any, NamedTuple

import numpy as np

from realtime.kernels.jit import Record, Records, only_with

# u+ = turn u - kept u- + drive F; what is heard is (u+ - u-)/2, scaled into `drive`.
MODE: np.dtype[Any] = np.dtype(
    [("turn", "f8"), ("kept", "f8"), ("drive", "f8"), ("now", "f8"), ("before", "f8")], align=True
)
STATE: np.dtype[Any] = np.dtype([("force", "f8"), ("gain", "f8"), ("width", "f8")], align=True)
# Bending modes of a ring, n = 2 .. 7, to the lowest.
RATIOS = tuple(n * (n * n - 1) / math.sqrt(n * n + 1) / (6.0 / math.sqrt(5.0)) for n in range(2, 8))


class Rim(NamedTuple):
    """modes (m,) of MODE; state (1,) of STATE."""

    modes: Records
    state: Records


@only_with("rim")
def begin(engine: Record) -> None:
    """Before this step's forces."""
    engine.rim.state[0].force = 0.0


@only_with("rim", otherwise=0.0)
def share(engine: Record, x: float, y: float) -> float:
    """What of a blow at (x, y), in radii, the hoop gets: all from the rim on, none further in than `width`."""
    width = engine.rim.state[0].width
    return min(max((math.hypot(x, y) - (1.0 - width)) / width, 0.0), 1.0)


@only_with("rim")
def strike(engine: Record, x: float, y: float, impulse: float) -> None:
    """A blow of so much impulse, N steps, at (x, y).

    Wood on metal is over within a step, however long the head is touched: the hoop gets its share of it at once.
    """
    engine.rim.state[0].force += impulse * share(engine, x, y)


@only_with("rim", otherwise=0.0)
def heard(engine: Record) -> float:
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
def rest(engine: Record) -> None:
    """All at rest."""
    for i in range(engine.rim.modes.shape[0]):
        engine.rim.modes[i].now = 0.0
        engine.rim.modes[i].before = 0.0
