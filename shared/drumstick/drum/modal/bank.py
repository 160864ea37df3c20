"""A bank of modes, each an oscillator that turns and fades exactly as its mode does. Audio thread; no allocation.

With q a mode's displacement and d what it moved in the last step, a step is

    d' = R^2 d - k q + drive,   q' = q + d',   k = 1 - 2 R cos(theta) + R^2

which is q' = 2 R cos(theta) q - R^2 q- + drive, but in float32 keeps the pitch of slow modes: there 2 R cos(theta) is
close to 2, and rounding it alone would put 150 Hz at 48 kHz out of tune by a quarter of a cent.

A strike drives each mode by the mode's own shape where it lands, taken once from a table when the strike begins. Modes
come in pairs, cos(m phi) first, then sin(m phi); of the round ones (m = 0) the second is never driven.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.memory.bank import Bank
from drumstick.drum.modal import blocks, held, stretch
from drumstick.drum.output import stems
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]
_PART = 1024  # modes


@njit()
def _fill_angular(angular: npt.NDArray[np.float64], angle: float) -> None:
    cosine, sine = math.cos(angle), math.sin(angle)
    angular[0, 0], angular[1, 0] = 1.0, 0.0
    for m in range(1, angular.shape[1]):
        angular[0, m] = cosine * angular[0, m - 1] - sine * angular[1, m - 1]
        angular[1, m] = sine * angular[0, m - 1] + cosine * angular[1, m - 1]


@njit(fastmath={"contract"})
def compute_strike_weights(bank: Bank, row: int, x: float, y: float) -> None:
    """Weights by which a force at (x, y), in radii, drives each mode, into bank.strike_weights[row].

    Cubic interpolation (Catmull-Rom).
    """
    _fill_angular(bank.angular, math.atan2(y, x))
    at = min(math.hypot(x, y), 1.0) * (bank.radial.shape[0] - 3)
    first = min(int(at), bank.radial.shape[0] - 4)
    t = at - first
    w0 = np.float32(-0.5 * t * (1.0 - t) ** 2)
    w1 = np.float32(1.0 + t * t * (1.5 * t - 2.5))
    w2 = np.float32(t * (0.5 + t * (2.0 - 1.5 * t)))
    w3 = np.float32(-0.5 * t * t * (1.0 - t))
    count = bank.orders.shape[0]
    for p in range(count):
        shape = (
            w0 * bank.radial[first, p]
            + w1 * bank.radial[first + 1, p]
            + w2 * bank.radial[first + 2, p]
            + w3 * bank.radial[first + 3, p]
        )
        m = bank.orders[p]
        bank.strike_weights[row, p] = shape * np.float32(bank.angular[0, m])
        bank.strike_weights[row, count + p] = shape * np.float32(bank.angular[1, m])
    held.turn_and_scale(bank, row)


@only_with("modal")
def set_strike_weights(engine: "Engine", row: int, x: float, y: float) -> None:
    """A strike begins: `row` is its pulse's place in the pool."""
    compute_strike_weights(engine.modal, row, x, y)


@njit(fastmath={"contract"})
def _drive(d: Floats, strike_weights: Floats, strength: np.float32) -> None:
    for i in range(d.shape[0]):
        d[i] += strike_weights[i] * strength


@only_with("modal")
def push(engine: "Engine", row: int, force: float) -> None:
    """The mean force of one pulse, N, over the coming step."""
    push_by(engine, row, force, stretch.of_newton(engine, row))


@only_with("modal")
def push_by(engine: "Engine", row: int, force: float, stretch_per_newton: float) -> None:
    """`push`, where what a newton stretches the head by is known."""
    stretch.push(engine, force * stretch_per_newton)
    _drive(engine.modal.d, engine.modal.strike_weights[row], np.float32(force))


@njit(fastmath={"contract"})
def _move(q: Floats, d: Floats, r_squared: Floats, stiffness: Floats) -> None:
    for i in range(q.shape[0]):
        moved = r_squared[i] * d[i] - stiffness[i] * q[i]
        d[i] = moved
        q[i] += moved


@njit(fastmath={"contract"})
def _drawn(d: Floats, tension_stiffness: Floats, q: Floats, pull: np.float32) -> None:
    for i in range(d.shape[0]):
        d[i] -= pull * (tension_stiffness[i] * q[i])


@only_with("tension_stiffness")
def _pull(bank: Bank, first: int, last: int, pull: np.float32) -> None:
    if pull != np.float32(0.0):
        _drawn(bank.d[first:last], bank.tension_stiffness[first:last], bank.q[first:last], pull)


@njit(fastmath={"contract", "reassoc"})
def _heard(values: Floats, gains: Floats) -> float:
    total = np.float32(0.0)
    for i in range(values.shape[0]):
        total += gains[i] * values[i]
    return float(total)


@only_with("left_by_displacement", otherwise=0.0)
def _heard_left(bank: Bank, first: int, last: int) -> float:
    return _heard(bank.q[first:last], bank.left_by_displacement[first:last])


@only_with("right_by_displacement", otherwise=0.0)
def _heard_right(bank: Bank, first: int, last: int) -> float:
    return _heard(bank.q[first:last], bank.right_by_displacement[first:last])


@njit()
def step_modes(bank: Bank, pull: float, begin: int, end: int) -> tuple[float, float]:
    """One step of these modes, under a pull of the tension; returns what pickups, or microphones, hear, left and right.

    In loops of few arrays each: compilers find vectors only where they can tell that none overlaps another. A part of
    the modes at a time, which the first loop leaves in the nearest cache for the next.
    """
    q, d, r_squared, stiffness, left, right = (
        bank.q,
        bank.d,
        bank.r_squared,
        bank.stiffness,
        bank.left,
        bank.right,
    )
    heard_left = heard_right = 0.0
    for first in range(begin, end, _PART):
        last = min(first + _PART, end)
        _pull(bank, first, last, np.float32(pull))
        _move(q[first:last], d[first:last], r_squared[first:last], stiffness[first:last])
        heard_left += _heard(d[first:last], left[first:last]) + _heard_left(bank, first, last)
        heard_right += _heard(d[first:last], right[first:last]) + _heard_right(bank, first, last)
    return heard_left, heard_right


@only_with("modal", otherwise=(0.0, 0.0))
def step(engine: "Engine") -> Any:
    """`step_modes` of all, under what tension they have; or what a block has taken of it already."""
    if blocks.is_ahead(engine):
        return blocks.handed_out(engine)
    heard = step_modes(engine.modal, stretch.pull(engine), 0, engine.modal.q.shape[0])
    stems.add_modes(engine)
    stretch.look(engine)
    return heard


@njit()
def _largest(bank: Bank) -> float:
    top = np.float32(0.0)
    for i in range(bank.q.shape[0]):
        top = max(top, abs(bank.q[i]), abs(bank.d[i]))
    return float(top)


@only_with("modal", otherwise=0.0)
def largest(engine: "Engine") -> float:
    """The largest displacement of any mode."""
    return _largest(engine.modal)


@only_with("modal")
def reset(engine: "Engine") -> None:
    """All at rest."""
    engine.modal.q[:] = np.float32(0.0)
    engine.modal.d[:] = np.float32(0.0)
    stretch.reset(engine)
