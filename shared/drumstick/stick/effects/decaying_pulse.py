"""Common part of `pulse` and `cor_pulse`: a push that starts at once and fades, h(t) = (m dv / tau) exp(-t / tau), (4).

`parameters` is the effect's part of the law, `state` its part of the motion. The push is kept as an acceleration,
h/m, so a change of m above the head leaves the speed it still has to give unchanged. Kernels: tick thread; no
allocation.
"""

import math
from typing import Protocol

from drumstick.stick.effects import triggers
from drumstick.stick.records import Motion
from realtime.kernels.jit import njit
from realtime.records import Record

ADD, REPLACE, IGNORE = 0, 1, 2
TRIGGERS = ("entry", "turn", "exit")  # in the order of effects.triggers
OVERLAPS = ("add", "replace", "ignore")
DELIVERED_AFTER_TAUS = 5.0  # for overlap = "ignore": by then 99.3 % of dv has been given
SPENT_M_PER_S = 1e-25  # a tail that can still give less than this is set to 0, before it becomes denormal


class PulseParameters(Protocol):
    """Parameters that such an effect has in its law, besides the strength; choices by their index."""

    tau: float
    trigger: int
    sign: int
    overlap: int


class PulseState(Record):
    """State of a pulse between ticks: its push h/m, m/s^2, and the time since it fired, s."""

    acceleration: float
    age: float


@njit()
def fire(parameters: PulseParameters, state: PulseState, when: int, speed: float) -> None:
    """Start a pulse that adds `speed` m/s, if it fires `when`."""
    if parameters.trigger != when:
        return
    still_giving = state.age < DELIVERED_AFTER_TAUS * parameters.tau and state.acceleration != 0.0
    if parameters.overlap == IGNORE and still_giving:
        return
    acceleration = parameters.sign * speed / parameters.tau
    if parameters.overlap == ADD:
        acceleration += state.acceleration
    state.acceleration = acceleration
    state.age = 0.0


@njit()
def is_pending(parameters: PulseParameters, motion: Motion) -> bool:
    """Will the present contact's first deepest point still start one?"""
    return parameters.trigger == triggers.ON_TURN and motion.turned == 0


@njit()
def fade(parameters: PulseParameters, duration: float) -> float:
    """The share of a push that is left after `duration` seconds."""
    return math.exp(-(1.0 / parameters.tau) * duration)


@njit()
def elapse(parameters: PulseParameters, state: PulseState, duration: float, fade: float) -> None:
    """Let the push fade to that share in `duration` seconds."""
    acceleration = state.acceleration * fade
    state.acceleration = 0.0 if abs(acceleration) * parameters.tau < SPENT_M_PER_S else acceleration
    state.age += duration


@njit()
def max_overlap(parameters: PulseParameters, soonest: float) -> float:
    """Largest number of pulses that push at once, counted by their force, when two never fire within `soonest`
    seconds.
    """
    return 1.0 / -math.expm1(-soonest / parameters.tau) if parameters.overlap == ADD else 1.0
