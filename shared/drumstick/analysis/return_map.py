"""The return map in one number: a speed now, the same speed one contact later.

The state of a lap (drumstick.analysis.lap) also holds what the pulses still have to give. Here that is made to fit the
speed: it is the amount that the lap itself reproduces ("self-consistent"), so that fixed points of this map of one
number are fixed points of the whole motion.

    mapped = return_map(scene, np.linspace(0.01, 2.0, 400))   # v_E -> the next v_E, for the cobweb figure

Kernels: any thread; a few small arrays. `return_map`: any thread; blocks for about 20 us a point.
"""

import math

import numpy as np
import numpy.typing as npt

from drumstick import exact
from drumstick.analysis import lap
from drumstick.analysis.lap import COR_PULSE, COR_PULSE_AGE, PULSE, PULSE_AGE, V_OUT
from drumstick.law import law_of, thrown
from drumstick.scene import Scene
from realtime.jit import Record, Records, njit, only_with

Numbers = npt.NDArray[np.float64]

# The pulses' rest at the end of the lap does not settle to that of its start: no motion of this period has this speed.
UNSETTLED = 4
# What the frozen speed is: v_out, or v_E = v_out and what the pulses still have to give.
OF_V_OUT, OF_V_E = 0, 1

_LONG_AGO_S = 1e9
_MOST_STEPS = 40
_SAME, _ALMOST_SAME = 4e-15, 1e-12


@only_with("pulse", otherwise=0.0)
def _kick(law: Record) -> float:
    return law.pulse.sign * law.pulse.dv_pls


@only_with("cor_pulse", otherwise=0.0)
def _cor_kick(law: Record) -> float:
    return law.cor_pulse.sign * law.cor_pulse.gamma


@njit()
def guess(law: Record, speed: float, start: Numbers) -> None:
    """Write a first guess of the state: pulses that have only just fired, and nothing left of earlier ones."""
    start[V_OUT] = speed
    start[PULSE] = _kick(law)
    start[COR_PULSE] = _cor_kick(law) * speed
    start[PULSE_AGE] = _LONG_AGO_S
    start[COR_PULSE_AGE] = _LONG_AGO_S


@njit()
def _lap_from(
    law: Record,
    scratch: Records,
    speed: float,
    of: int,
    start: Numbers,
    end: Numbers,
    told: Numbers,
    patience: int,
) -> int:
    # One evaluation with the pushes of `start`; told: shape (laps, 6).
    start[V_OUT] = speed - (start[PULSE] + start[COR_PULSE] if of == OF_V_E else 0.0)
    if not start[V_OUT] > 0.0:
        return UNSETTLED
    end[:] = start
    return lap.laps(law, scratch[1:], scratch[:1], end, told.shape[0], patience, told)


@njit()
def self_consistent(
    law: Record,
    scratch: Records,
    speed: float,
    of: int,
    start: Numbers,
    end: Numbers,
    told: Numbers,
    patience: int,
) -> int:
    """Find the pushes that told.shape[0] laps from `speed` reproduce, by Broyden's method (with one pulse: secant).

    scratch: shape (2,): a motion to work on and a fresh one. start: the first guess, then the state found. end: the
    state after the laps. told: shape (laps, 6). Returns exact.MOVING; how the lap ended instead; or UNSETTLED.
    """
    # b is the inverse of the Jacobian of the mismatch h; -1 times the unit matrix makes the first step a plain lap.
    b00, b01, b10, b11 = -1.0, 0.0, 0.0, -1.0
    h0, h1, step0, step1, size = 0.0, 0.0, 0.0, 0.0, 0.0
    for turn in range(_MOST_STEPS):
        fate = _lap_from(law, scratch, speed, of, start, end, told, patience)
        if fate != exact.MOVING:
            return fate
        was0, was1 = h0, h1
        h0, h1 = end[PULSE] - start[PULSE], end[COR_PULSE] - start[COR_PULSE]
        size = abs(speed) + end[V_OUT] + abs(end[PULSE]) + abs(end[COR_PULSE])
        if abs(h0) + abs(h1) <= _SAME * size:
            return exact.MOVING
        if turn > 0:
            d0, d1 = h0 - was0, h1 - was1
            t0, t1 = b00 * d0 + b01 * d1, b10 * d0 + b11 * d1
            r0, r1 = step0 * b00 + step1 * b10, step0 * b01 + step1 * b11
            scale = step0 * t0 + step1 * t1
            if scale != 0.0:
                e0, e1 = (step0 - t0) / scale, (step1 - t1) / scale
                b00, b01, b10, b11 = b00 + e0 * r0, b01 + e0 * r1, b10 + e1 * r0, b11 + e1 * r1
        step0, step1 = -(b00 * h0 + b01 * h1), -(b10 * h0 + b11 * h1)
        if not (math.isfinite(step0) and math.isfinite(step1)):
            return UNSETTLED
        start[PULSE] += step0
        start[COR_PULSE] += step1
        start[PULSE_AGE], start[COR_PULSE_AGE] = end[PULSE_AGE], end[COR_PULSE_AGE]
    # Where rounding keeps the last digits apart, what is left is still far below what matters.
    return exact.MOVING if abs(h0) + abs(h1) <= _ALMOST_SAME * size else UNSETTLED


@njit()
def from_guess(
    law: Record,
    scratch: Records,
    speed: float,
    of: int,
    start: Numbers,
    end: Numbers,
    told: Numbers,
    patience: int,
) -> int:
    """As `self_consistent`, from the state in `start` if that leads anywhere, else from `guess` or without pulses."""
    fate = self_consistent(law, scratch, speed, of, start, end, told, patience)
    if fate == exact.MOVING:
        return fate
    guess(law, speed, start)
    fate = self_consistent(law, scratch, speed, of, start, end, told, patience)
    if fate == exact.MOVING:
        return fate
    guess(law, speed, start)
    start[PULSE] = 0.0
    start[COR_PULSE] = 0.0
    return self_consistent(law, scratch, speed, of, start, end, told, patience)


@njit()
def _map(law: Record, scratch: Records, v_e: Numbers, after: Numbers) -> None:
    start, end, told = np.zeros(lap.STATE_SIZE), np.zeros(lap.STATE_SIZE), np.zeros((1, lap.TOLD_SIZE))
    guess(law, v_e[0], start)
    for i in range(v_e.shape[0]):
        fate = from_guess(law, scratch, v_e[i], OF_V_E, start, end, told, lap.PATIENCE)
        after[i] = told[0, lap.V_E] if fate == exact.MOVING else np.nan


def scratch_of(scene: Scene) -> Records:
    """What the kernels work on: shape (2,), a motion and a fresh one."""
    return np.repeat(thrown(scene, 0.0), 2)


def return_map(scene: Scene, v_e_m_per_s: Numbers) -> Numbers:
    """v_E of the next contact for each v_E, shape (n,), m/s.

    NaN where there is no next contact, or no such speed: with a pulse at exit v_E is never below dv.
    """
    after = np.full(len(v_e_m_per_s), np.nan)
    _map(law_of(scene)[0], scratch_of(scene), np.ascontiguousarray(v_e_m_per_s, np.float64), after)
    return after
