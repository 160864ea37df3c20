"""Modes of a bank under something that is pressed on the head, harder and softer while it plays.

With s and K of a mode as in drumstick.drum.mallets.shares, it is q+ - 2 q + q- = -K q - s (q+ - q-), and R^2 =
(1 - s)/(1 + s), k = K/(1 + s). What lies on the head adds p s_m to s and leaves K: with h = p s_m/(1 + s) that makes
(R^2 - h)/(1 + h) of R^2 and k/(1 + h) of k. The energy ((q - q-)^2 + K q q-)/2 has no s in it, so wherever p goes, and
however fast, a step only takes from it. So that a newton moves the mode as before, all that is divided by what a step
keeps, 1 - s, follows: weights of strikes and what the tension's pull takes from d grow by R^2/(R^2 - h), and the masses
that mallets see fall by it.

It moves at steps whose number is a multiple of PRESS_STEPS: so the length of audio blocks changes no bit once the drum
is awake. All modes and all tips are gone through then, so it is seldom: a jump of the loss alone makes no click. A tip
that is pressed in stays where it is, for what it sees of the head has no p in it; so no roll, however dense, holds the
hand up. A pulse that is being given keeps its weights, with h of a step at most too much or too
little. Kernels: audio thread; no allocation.
"""

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import composition
from drumstick.drum.memory.bank import PRESS_STEPS, STEPS, Bank
from drumstick.drum.modal import blocks, stretch
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

Floats = npt.NDArray[np.float32]


@only_with("held")
def turn_and_scale(bank: Bank, row: int) -> None:
    """Weights of a force on the modes as they are turned and held, in place of those of cos(m phi) and sin(m phi)."""
    held, weights, count = bank.held, bank.strike_weights[row], bank.orders.shape[0]
    for p in range(count):
        cosine, sine, first, second = held.turn[0, p], held.turn[1, p], weights[p], weights[count + p]
        weights[p] = held.drive_scale[p] * (cosine * first + sine * second)
        weights[count + p] = held.drive_scale[count + p] * (cosine * second - sine * first)


@only_with("masses")
def _lighten(bank: Bank) -> None:
    for i in range(bank.q.shape[0]):
        bank.masses[i] = bank.held.masses[i] / bank.held.drive_scale[i]


@only_with("tension_stiffness")
def _draw_harder(bank: Bank) -> None:
    for i in range(bank.q.shape[0]):
        bank.tension_stiffness[i] = bank.held.tension_stiffness[i] * bank.held.drive_scale[i]


@njit()
def _hold(bank: Bank, press: float) -> None:
    held, pressed, one = bank.held, np.float32(press), np.float32(1.0)
    for i in range(bank.q.shape[0]):
        h = pressed * held.share[i]
        left = held.r_squared[i] - h
        bank.r_squared[i] = left / (one + h)
        bank.stiffness[i] = held.stiffness[i] / (one + h)
        held.drive_scale[i] = held.r_squared[i] / left
    _lighten(bank)
    _draw_harder(bank)


@only_with("held", otherwise=False)
def _follow(bank: Bank, engine: "Engine") -> bool:
    if (
        engine.control[0].steps % PRESS_STEPS != 0
        or blocks.is_ahead(engine)
        or not composition.is_moving(engine)
    ):
        return False
    composition.before_modes(engine, PRESS_STEPS)
    if not composition.has_moved(engine):
        return False
    _hold(bank, composition.press(engine))
    stretch.look(engine)  # what the last step foresaw was by the coefficients before
    return True


@only_with("modal", otherwise=False)
def follow(engine: "Engine") -> bool:
    """Hold the modes, before a step, as hard as is pressed now; True when they give way otherwise than before."""
    return _follow(engine.modal, engine)


@only_with("held")
def _take_up(bank: Bank, engine: "Engine") -> None:
    if composition.has_moved(engine):
        _hold(bank, composition.press(engine))


@only_with("modal")
def take_up(engine: "Engine") -> None:
    """Hold the modes as was set while nothing sounded."""
    _take_up(engine.modal, engine)


@only_with("held", otherwise=STEPS)
def _steps_between(bank: Bank, engine: "Engine") -> int:
    return int(
        PRESS_STEPS - engine.control[0].steps % PRESS_STEPS if composition.is_moving(engine) else STEPS
    )


@only_with("modal", otherwise=STEPS)
def steps_between(engine: "Engine") -> int:
    """Coming steps in which nothing is pressed harder or softer."""
    return int(_steps_between(engine.modal, engine))
