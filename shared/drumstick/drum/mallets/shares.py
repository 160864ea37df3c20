"""The modes under a mallet's tip: how it reads a bank of modes and how it pushes it, by the very same shares.

The tip rests on the head as a paraboloid, 1 - (r/R)^2 at r from its middle. A mode's mean under it is the mode's shape
in its middle, times 8 J2(a)/a^2 with a = j R (a mode is a sum of plane waves, and this is what the paraboloid leaves of
each), which the bank's table of shapes has in it. With these shares g the head under the tip is y = sum g q, and a push
F drives each mode by g F.

A mode is q+ = 2 R cos(theta) q - R^2 q- + b g F (drumstick.drum.modal.bank). With s = (1 - R^2)/(1 + R^2) that is

    q+ - 2 q + q- = -K q - s (q+ - q-) + (1 + s) b g F,      K = 2 - 2 (1 - s^2)^(1/2) cos(theta),  0 < K < 4,

so its energy ((q - q-)^2 + K q q-)/(2 (1 + s) b) is never negative, and a step adds to it
g F (q+ - q-)/2 - s (q+ - q-)^2/(2 (1 + s) b). The sum over the modes is at most F (y+ - y-)/2, which is all that the
tip's law asks for. Kernels: audio thread; no allocation.
"""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.modal import bank
from realtime.kernels.jit import njit

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]


@njit(fastmath={"contract", "reassoc"})
def _given(r_squared: Floats, masses: Floats, one: Floats, other: Floats) -> float:
    total = 0.0
    for i in range(r_squared.shape[0]):
        total += float(masses[i] * one[i]) * float(r_squared[i] * other[i])
    return total


@njit()
def place_tip(engine: "Engine", slot: int, x: float, y: float) -> float:
    """Put a tip on the head at (x, y), in radii; returns how far a newton moves the head under it in a step."""
    modes, own = engine.modal, engine.mallets.shares
    bank.compute_strike_weights(modes, slot, x, y)
    strike_weights, still, moving = modes.strike_weights[slot], own.still[slot], own.moving[slot]
    one = np.float32(1.0)
    for i in range(strike_weights.shape[0]):
        share = modes.masses[i] * strike_weights[i]
        still[i] = share * (one - modes.stiffness[i])
        moving[i] = share * modes.r_squared[i]
    for other in range(own.mutual_compliance.shape[0]):
        given = _given(modes.r_squared, modes.masses, strike_weights, modes.strike_weights[other])
        own.mutual_compliance[slot, other] = own.mutual_compliance[other, slot] = given
    return float(own.mutual_compliance[slot, slot])


@njit()
def under(engine: "Engine", slot: int) -> tuple[float, float]:
    """sum g q and sum g q-: how high the head stands under the tip, and stood a step before."""
    modes, height, moved = engine.modal, 0.0, 0.0
    strike_weights = modes.strike_weights[slot]
    for i in range(strike_weights.shape[0]):
        share = float(modes.masses[i] * strike_weights[i])
        height += share * float(modes.q[i])
        moved += share * float(modes.d[i])
    return height, height - moved


@njit(fastmath={"contract", "reassoc"})
def _after(still: Floats, moving: Floats, q: Floats, d: Floats) -> float:
    total = 0.0
    for i in range(q.shape[0]):
        total += float(still[i]) * float(q[i]) + float(moving[i]) * float(d[i])
    return total


@njit()
def ahead(engine: "Engine", slot: int) -> float:
    """Position of the head under the tip after this step without a push."""
    own = engine.mallets.shares
    return float(_after(own.still[slot], own.moving[slot], engine.modal.q, engine.modal.d))
