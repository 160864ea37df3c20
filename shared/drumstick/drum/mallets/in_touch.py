"""The step of a bank under tension that a mallet meets: all that a step needs of the modes, in one loop over them.

A step is a push and a pull on each mode, its movement, what is heard of it; and for the step to come how the modes
stretch the head, what a newton would stretch it by, and where it will be under the tip. In loops of their own these
read the bank, more than a second cache holds, five times; together once, which takes 0.4 to 0.5 of the time. The sums
are those of drumstick.drum.modal.bank, drumstick.drum.modal.stretch and drumstick.drum.mallets.shares.

One mallet is carried so, the newest that plays; others push and look by loops of their own. Kernels: audio thread; no
allocation.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.modal import bank, blocks, stretch
from drumstick.drum.output import stems
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.effects.tension import TensionState
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]
_PART = 1024  # modes, whose sums single precision holds


@njit(fastmath={"contract", "reassoc"})
def _stepped(
    drive: Any, arrays: Any, left_still: Any, right_still: Any
) -> tuple[float, float, float, float, float, float, float]:
    # A step of some modes: heard left and right; of the next step S-, x and y; a newton's stretch; under the tip.
    force, pull, strike_weights, masses = drive
    q, d, r_squared, stiffness, left, right, _, _, tension_stiffness = arrays
    heard_left = heard_right = before = x = y = newton = ahead = np.float32(0.0)
    for i in range(q.shape[0]):
        r2, k, weight, by_tension = r_squared[i], stiffness[i], strike_weights[i], tension_stiffness[i]
        moved = r2 * (d[i] + weight * force - pull * (by_tension * q[i])) - k * q[i]
        place = q[i] + moved
        d[i], q[i] = moved, place
        heard_left += left[i] * moved
        heard_right += right[i] * moved
        if left_still is not None:  # decided by the type, at compile time
            heard_left += left_still[i] * place
        if right_still is not None:
            heard_right += right_still[i] * place
        coming = r2 * moved - k * place
        stretched = by_tension * masses[i] * place  # as the stretch weights are: one array less to read
        before += stretched * (place - moved)
        x -= stretched * (coming + moved)
        y += stretched * (r2 * (by_tension * place))
        newton += stretched * (r2 * weight)
        ahead += (masses[i] * weight) * (place + coming)
    return (
        float(heard_left),
        float(heard_right),
        float(before),
        float(x),
        float(y),
        float(newton),
        float(ahead),
    )


@only_with("tension", otherwise=(0.0, 0.0))
def _step(engine: "Engine") -> Any:
    modes, state = engine.modal, engine.mallets.state[0]
    tight: TensionState = engine.effects.tension.state[0]
    slot = state.carried
    force, pull = np.float32(engine.mallets.pool[slot].force), np.float32(stretch.pull(engine))
    weights = modes.strike_weights[slot]
    heard_left = heard_right = before = x = y = newton = ahead = 0.0
    for first in range(0, modes.q.shape[0], _PART):
        last = min(first + _PART, modes.q.shape[0])
        arrays = blocks.arrays_of(modes, first, last)
        drive = (force, pull, weights[first:last], modes.masses[first:last])
        part = _stepped(drive, arrays, arrays[6], arrays[7])
        heard_left += part[0]
        heard_right += part[1]
        before += part[2]
        x += part[3]
        y += part[4]
        newton += part[5]
        ahead += part[6]
    stems.add_modes(engine)
    tight.before, tight.x, tight.y = before, x, y
    state.newton_ahead, state.height_ahead = newton, ahead
    state.carried, state.foreseen = -1, slot
    return heard_left, heard_right


@only_with("tension", otherwise=False)
def _is_under_tension(engine: "Engine") -> bool:
    return True


@only_with("mallets", otherwise=False)
def _is_carried(engine: "Engine") -> bool:
    return engine.mallets.state[0].carried >= 0


@only_with("mallets", otherwise=(0.0, 0.0))
def _carried_on(engine: "Engine") -> Any:
    return _step(engine)


@njit()
def push(engine: "Engine", slot: int, is_newest: bool) -> None:
    """A mallet pushes the bank over the coming step: the newest with that step, others at once."""
    mallet = engine.mallets.pool[slot]
    if is_newest and _is_under_tension(engine):
        stretch.push(engine, -mallet.force * mallet.stretch_per_newton)
        engine.mallets.state[0].carried = slot
    else:
        bank.push_by(engine, slot, mallet.force, -mallet.stretch_per_newton)


@only_with("modal", otherwise=(0.0, 0.0))
def step(engine: "Engine") -> Any:
    """A step of the bank, after all pushes; returns what is heard of it, left and right."""
    if _is_carried(engine):
        return _carried_on(engine)
    return bank.step(engine)
