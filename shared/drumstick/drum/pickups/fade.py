"""Crossfade of pickups that move while the drum plays, from the places where they were to those where they are set.

What is heard is a sum over gains: on a mesh of each junction around a pickup, in a bank of each mode. So a crossfade
moves each gain from what it was to what it will be, a step at a time, along half a cosine. Gains are only read:
whatever they are, no energy comes back into the drum. In a bank the steps of a fade are taken one by one. Kernels:
audio thread; no allocation. A drum whose pickups stay compiles none of this.
"""

import math
from collections.abc import Callable, Sized
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.bank import STEPS
from drumstick.drum.memory.pickup_fade import DONE, OFFERED
from drumstick.drum.modal import blocks
from realtime.atomics import load_acquire, store_release
from realtime.kernels.jit import ArgumentType, njit, only_with, overload

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine
    from drumstick.drum.memory.pickup_fade import PickupFadeState


@njit(fastmath={"contract"})
def _approach(gains: npt.NDArray[Any], goal: npt.NDArray[Any], share: np.float32) -> None:
    if gains.ndim == 1:  # decided by the type, at compile time
        for i in range(gains.shape[0]):
            gains[i] += share * (goal[i] - gains[i])
    else:
        for row in range(gains.shape[0]):
            for i in range(gains.shape[1]):
                gains[row, i] += share * (goal[row, i] - gains[row, i])


@njit()
def _move_one(ramp: Any, share: float) -> None:
    if share < 1.0:
        _approach(ramp[0], ramp[1], np.float32(share))
    else:
        ramp[0][:] = ramp[1]


def _move(ramps: Any, share: float) -> None:
    raise TypeError("compiled code only")


@overload(_move)
def _move_by_type(ramps: ArgumentType, share: ArgumentType) -> Callable[[Any, float], None]:
    def move(ramps: Any, share: float) -> None:
        _move_one(ramps[0], share)
        _move(ramps[1:], share)

    return move if len(cast(Sized, ramps)) else lambda ramps, share: None


@only_with("pickup_fade", otherwise=False)
def _is_on_its_way(engine: "Engine") -> bool:
    cells = engine.pickup_fade.cells
    return load_acquire(cells, OFFERED) != load_acquire(cells, DONE)


@njit()
def _arrive(engine: "Engine") -> None:
    # The gains are free for the next places: none are offered before.
    cells = engine.pickup_fade.cells
    store_release(cells, DONE, load_acquire(cells, OFFERED))


@only_with("pickup_fade")
def advance(engine: "Engine") -> None:
    """Go on with a fade before a step, or begin one, unless a bank has taken the step already."""
    state: PickupFadeState = engine.pickup_fade.state[0]
    if state.left == 0:
        if not _is_on_its_way(engine) or blocks.is_ahead(engine):
            return
        state.left = state.steps
    before = 0.5 + 0.5 * math.cos(math.pi * (1.0 - state.left / state.steps))  # of the way, still to go
    after = 0.5 + 0.5 * math.cos(math.pi * (1.0 - (state.left - 1) / state.steps))
    _move(engine.pickup_fade.ramps, 1.0 - after / before)
    state.left -= 1
    if state.left == 0:
        _arrive(engine)


@only_with("pickup_fade")
def settle(engine: "Engine") -> None:
    """Be there at once: nothing is heard."""
    state: PickupFadeState = engine.pickup_fade.state[0]
    if _is_on_its_way(engine):
        _move(engine.pickup_fade.ramps, 1.0)
        state.left = 0
        _arrive(engine)


@only_with("pickup_fade", otherwise=STEPS)
def steps_between(engine: "Engine") -> int:
    """Coming steps in which no gain moves: 0 during a fade."""
    return 0 if _is_on_its_way(engine) else STEPS


@njit()
def settle_now(engine: "Engine") -> None:
    """`settle`, from Python: of an engine that nobody plays."""
    settle(engine)
