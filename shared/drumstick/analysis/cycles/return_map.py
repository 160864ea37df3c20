"""The return map in one number: a speed now, the same speed one contact later.

The state of a return (drumstick.analysis.cycles.return_step) also holds what the pulses still have to give. Here that
is made to fit the speed: it is the amount that the returns themselves reproduce ("self-consistent"), so that fixed
points of this map of one number are fixed points of the whole motion.

    after = return_map(scene, np.linspace(0.01, 2.0, 400))   # v_E -> the next v_E, for the cobweb figure

Any thread; blocks for about 30 us a speed.
"""

import math
from typing import Any

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.return_step import (
    COR_PULSE,
    COR_PULSE_AGE,
    EFFORT,
    MEASURED_SIZE,
    PULSE,
    PULSE_AGE,
    STATE_SIZE,
    V_E,
    V_OUT,
    Numbers,
)
from drumstick.parameters.scene import Scene
from drumstick.stick.effects.cor_pulse import CorPulseLaw, speed_factor
from drumstick.stick.effects.pulse import PulseLaw
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from drumstick.stick.records import Law
from realtime.kernels.jit import njit, only_with
from realtime.records import Records

# No pushes fit: no motion of this period has this speed.
UNSETTLED = 4
# What the frozen speed is: v_out, or v_E = v_out and what the pulses still have to give.
OF_V_OUT, OF_V_E = 0, 1

_LONG_AGO_S = 1e9
_MAX_STEPS = 16
_SAME, _ALMOST_SAME = 4e-15, 1e-12


@only_with("pulse", otherwise=0.0)
def _kick(law: Any) -> float:
    pulse: PulseLaw = law.pulse
    return pulse.sign * pulse.dv_pls


@only_with("cor_pulse", otherwise=0.0)
def _cor_kick(law: Any) -> float:
    cor_pulse: CorPulseLaw = law.cor_pulse
    return cor_pulse.sign * speed_factor(law)


@njit()
def _guess(law: Law, speed: float, share: float, start: Numbers) -> None:
    # A first guess of the state: pulses that fired just now and have this share left, and nothing of earlier ones.
    start[PULSE] = share * _kick(law)
    start[COR_PULSE] = share * _cor_kick(law) * speed
    start[PULSE_AGE] = _LONG_AGO_S
    start[COR_PULSE_AGE] = _LONG_AGO_S


@njit()
def _self_consistent(
    law: Law,
    scratch: Records,
    speed: float,
    of: int,
    start: Numbers,
    states: Numbers,
    patience: int,
    measured: Numbers,
) -> int:
    """Find the pushes that a number of returns from `speed` reproduce, by Broyden's method (with one pulse: secant).

    scratch: shape (2,). start: shape (5,), the first guess, then the state found. states, measured: as
    return_step.iterate. Returns exact.MOVING; how the returns ended instead; or UNSETTLED.
    """
    # b is the inverse of the Jacobian of the mismatch h; -1 times the unit matrix makes the first step a plain return.
    b00, b01, b10, b11 = -1.0, 0.0, 0.0, -1.0
    h0, h1, step0, step1, size = 0.0, 0.0, 0.0, 0.0, 0.0
    end = states[-1]
    for turn in range(_MAX_STEPS):
        start[V_OUT] = speed - (start[PULSE] + start[COR_PULSE] if of == OF_V_E else 0.0)
        if not start[V_OUT] > 0.0:
            return UNSETTLED
        return_step.set_state(law, scratch[1:], scratch[:1], start)
        outcome = return_step.iterate(law, scratch[0], states, patience, measured)
        if outcome != exact.MOVING:
            return outcome
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


class ReturnMap:
    """A number of returns from a speed, with pushes that fit.

    law: shape (1,), scratch: shape (2,) (return_step.scratch_of). After `at`: `start` is the state found, shape (5,),
    `states` those after each return, `measured` what return_step.iterate measures. The next speed starts from the
    pushes found last.
    """

    def __init__(self, law: Records, scratch: Records, returns: int, patience: int) -> None:
        self.start = np.zeros(STATE_SIZE)
        self.states = np.zeros((returns, STATE_SIZE))
        self.measured = np.zeros((returns, MEASURED_SIZE))
        self._law, self._scratch, self._patience = law[0], scratch, patience
        self.forget()

    def forget(self) -> None:
        """Start the next speed from pulses that have just fired."""
        _guess(self._law, 0.0, 1.0, self.start)

    @property
    def effort(self) -> float:
        """Computing done so far, in events (return_step.EFFORT)."""
        return float(self.measured[:, EFFORT].sum())

    def at(self, speed: float, of: int) -> bool:
        """Do the returns come round from this v_out or v_E (`of`), with some pushes?"""
        if self._reaches(speed, of):
            return True
        # The pushes of another speed may lead nowhere at this one.
        for share in (1.0, 0.0):
            _guess(self._law, speed, share, self.start)
            if self._reaches(speed, of):
                return True
        return False

    def _reaches(self, speed: float, of: int) -> bool:
        outcome = _self_consistent(
            self._law, self._scratch, speed, of, self.start, self.states, self._patience, self.measured
        )
        return outcome == exact.MOVING


def return_map(scene: Scene, v_e_m_per_s: Numbers) -> Numbers:
    """v_E of the next contact for each v_E, shape (n,), m/s.

    NaN where there is no next contact, or no such speed: with a pulse at exit v_E is never below dv.
    """
    one = ReturnMap(law_of(scene), return_step.scratch_of(scene), 1, return_step.MAX_WAIT_DOUBLINGS)
    return np.array([one.measured[0, V_E] if one.at(float(v), OF_V_E) else math.nan for v in v_e_m_per_s])
