"""`tension` on a bank of modes: what they stretch the head by, and how its tension then pulls them.

A mode is q+ - 2 q + q- = -K q - s (q+ - q-) + ..., of energy ((q - q-)^2 + K q q-)/(2 (1 + s) b)
(drumstick.drum.mallets.shares). A rise of the tension by the share g raises K by g times that part of it which is the
tension's, r: all of it, but for what a kettle's air holds. With S+ = sum l q+ q, where l = r K/((1 + s) b), and S- of
the step before, the step adds -g (S+ - S-)/2, and g is the discrete gradient of the tension's energy between the two:
what that energy gives, the modes lose (drumstick.drum.effects.tension). The sum of l q^2 is the integral of the squared
slope over a head of radius 1. (In drumstick.drum.effects.tension the pull g is called q.)

In the bank's terms (k its `stiffness`, R^2 its `r_squared`, s the mode's loss) K = k (1 + s): so a pull g subtracts
g r k q from the step, or g r k q/R^2 from the movement before it. Kernels: audio thread; no allocation.
"""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import tension
from drumstick.drum.memory.bank import Bank
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.effects.tension import TensionState
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]
_PART = 1024  # modes, whose sums single precision holds


@njit(fastmath={"contract", "reassoc"})
def _summed(
    stretch_weights: Floats,
    tension_stiffness: Floats,
    q: Floats,
    d: Floats,
    r_squared: Floats,
    stiffness: Floats,
) -> tuple[float, float, float]:
    # S-, x and y of some modes.
    before = x = y = np.float32(0.0)
    for i in range(q.shape[0]):
        stretch = stretch_weights[i] * q[i]
        before += stretch * (q[i] - d[i])
        x += stretch * (stiffness[i] * q[i] - r_squared[i] * d[i] - d[i])
        y += stretch * (r_squared[i] * (tension_stiffness[i] * q[i]))
    return float(before), float(x), float(y)


@njit()
def add_modes(modes: Bank, state: "TensionState", begin: int, end: int) -> None:
    """Add what these modes stretch the head by to the coming step's equation S+ = S- - x - y g."""
    for first in range(begin, end, _PART):
        last = min(first + _PART, end)
        before, x, y = _summed(
            modes.stretch_weights[first:last],
            modes.tension_stiffness[first:last],
            modes.q[first:last],
            modes.d[first:last],
            modes.r_squared[first:last],
            modes.stiffness[first:last],
        )
        state.before += before
        state.x += x
        state.y += y


@only_with("tension")
def look(engine: "Engine") -> None:
    """Set up the coming step's equation S+ = S- - x - y g from the modes; `push` adds forces to x."""
    state: TensionState = engine.effects.tension.state[0]
    state.before = state.x = state.y = 0.0
    add_modes(engine.modal, state, 0, engine.modal.q.shape[0])


@njit(fastmath={"contract", "reassoc"})
def _under(stretch_weights: Floats, r_squared: Floats, q: Floats, strike_weights: Floats) -> float:
    total = np.float32(0.0)
    for i in range(q.shape[0]):
        total += (stretch_weights[i] * q[i]) * (r_squared[i] * strike_weights[i])
    return float(total)


@only_with("tension", otherwise=0.0)
def of_newton(engine: "Engine", row: int) -> float:
    """Stretch that a force of 1 N over the coming step adds to S+, by its row of shares."""
    modes, total = engine.modal, 0.0
    strike_weights = modes.strike_weights[row]
    for first in range(0, modes.q.shape[0], _PART):
        last = min(first + _PART, modes.q.shape[0])
        total += _under(
            modes.stretch_weights[first:last],
            modes.r_squared[first:last],
            modes.q[first:last],
            strike_weights[first:last],
        )
    return total


@only_with("tension")
def push(engine: "Engine", newtons_stretch: float) -> None:
    """Something pushes the modes over the coming step, and stretches the head by so much."""
    state: TensionState = engine.effects.tension.state[0]
    state.x -= newtons_stretch


@njit()
def pull_for(engine: "Engine", newtons_x: float) -> float:
    """Pull g of the coming step, with forces that add so much to its x besides; kept as the last pull."""
    state: TensionState = engine.effects.tension.state[0]
    state.pull = tension.solved(state, state.before, state.x + newtons_x, state.y)
    return float(state.pull)


@only_with("tension", otherwise=0.0)
def pull(engine: "Engine") -> float:
    """Pull g of the coming step, after all its forces."""
    return pull_for(engine, 0.0)


@only_with("tension")
def reset(engine: "Engine") -> None:
    """All at rest."""
    state: TensionState = engine.effects.tension.state[0]
    state.before = state.x = state.y = state.pull = 0.0
