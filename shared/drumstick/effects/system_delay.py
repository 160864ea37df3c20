"""A head computed too late: its force is sampled every period_s, comes delay_ticks samples later, and is held.

Lag acts as negative damping, about -K_coll (period/2 + delay), and after the release the last force still pushes: the
rebound can be faster than the blow, and depends on where in the period the contact begins. Between samples the force is
constant: `exact` covers it. Kernels: tick thread; no allocation.
"""

import math
from dataclasses import dataclass

from drumstick.declare import count, number
from realtime.jit import Record, njit, only_with

MOST_TICKS = 8
STATE = (("held_N", "f8"), ("left_s", "f8"), ("next", "i8"), ("queue_N", "f8", (MOST_TICKS,)))
_DUE_S = 1e-15  # what rounding may leave of a time that is over
_PHASES = 32  # of the sampling, tried for the largest rebound
_FINE_SAMPLES = 60  # a contact of more samples is bounded by its lag alone
_MOST_SAMPLES = 400
_NOTHING_LATE = (0.0,) * MOST_TICKS
_MARGIN = 1.02  # between the phases tried, and for a hand that presses


@dataclass(frozen=True)
class SystemDelay:
    """`[effects.system_delay]`."""

    period_s: float = number(
        0.001, 1e-4, 0.02, "s", "Time between samples of the head's force", wire="system_delay.period",
        scale="log",
    )  # fmt: skip
    delay_ticks: int = count(1, 0, MOST_TICKS, "samples", "How many samples late the force comes")


@only_with("system_delay", otherwise=False)
def sampled(law: Record) -> bool:
    """Is the head's force a held sample?"""
    return True


@only_with("system_delay", otherwise=0.0)
def held(law: Record, motion: Record) -> float:
    """The force that acts now, N."""
    return motion.system_delay.held_N


@only_with("system_delay", otherwise=math.inf)
def due_in(law: Record, motion: Record) -> float:
    """Seconds until the next sample."""
    return motion.system_delay.left_s


@only_with("system_delay")
def elapse(law: Record, motion: Record, duration: float) -> None:
    """Count down to the next sample."""
    motion.system_delay.left_s -= duration


@njit()
def _later(state: Record, ticks: int, force: float) -> float:
    # The force of `ticks` samples ago; this one goes into the queue.
    if ticks == 0:
        return force
    place = state.next
    came = state.queue_N[place]
    state.queue_N[place] = force
    state.next = place + 1 if place + 1 < ticks else 0
    return came


@only_with("system_delay")
def renew(law: Record, motion: Record, force: float) -> None:
    """Take a sample, the head's force now, if it is due."""
    if motion.system_delay.left_s <= _DUE_S:
        motion.system_delay.left_s = law.system_delay.period
        motion.system_delay.held_N = _later(motion.system_delay, law.system_delay.delay_ticks, force)


@njit()
def _pending(state: Record) -> bool:
    total = abs(state.held_N)
    for index in range(MOST_TICKS):
        total += abs(state.queue_N[index])
    return total != 0.0


@only_with("system_delay", otherwise=False)
def lively(law: Record, motion: Record) -> bool:
    """Is a force acting or on its way?"""
    return _pending(motion.system_delay)


@only_with("system_delay")
def stop(law: Record, motion: Record) -> None:
    """Forget every force."""
    motion.system_delay.held_N = 0.0
    for index in range(MOST_TICKS):
        motion.system_delay.queue_N[index] = 0.0


@only_with("system_delay", otherwise=True)
def usable(law: Record) -> bool:
    """Is its number fit for a device?"""
    return 0.0 < law.system_delay.period < 1e3


@njit()
def _rebound_from(law: Record, wait: float) -> float:
    # The speed after a blow of 1 m/s, without a hand, when the first sample comes `wait` seconds after the contact.
    period, ticks = law.system_delay.period, law.system_delay.delay_ticks
    r = law.r_in - law.r_out
    z, v, held = -wait, -1.0, 0.0
    sum_of_queue = 0.0
    late = _NOTHING_LATE
    for _ in range(_MOST_SAMPLES):
        push = max(0.0, -law.k_coll * z - r * v) if z < 0.0 else 0.0
        came = push
        for tick in range(MOST_TICKS):
            if tick == ticks - 1:
                came = late[tick]
        late = (push,) + late[:-1]  # noqa: RUF005  numba joins tuples, but does not unpack them
        held = came / law.m
        sum_of_queue = 0.0
        for tick in range(MOST_TICKS):
            if tick < ticks:
                sum_of_queue += late[tick]
        if z >= 0.0 and v > 0.0 and held == 0.0 and sum_of_queue == 0.0:
            return v
        z += period * (v + 0.5 * period * held)
        v += period * held
    return math.inf


@only_with("system_delay", otherwise=0.0)
def rebound(law: Record) -> float:
    """The largest coefficient of restitution over all phases of the sampling, without a hand; inf if it never ends."""
    contact = math.pi * math.sqrt(law.m / law.k_coll)
    if contact > _FINE_SAMPLES * law.system_delay.period:  # then the lag is a negative damper
        lag = law.system_delay.period * (0.5 + law.system_delay.delay_ticks)
        zeta = (law.r_in - law.k_coll * lag) / (2.0 * math.sqrt(law.m * law.k_coll))
        if zeta <= -0.5:
            return math.inf
        return _MARGIN * math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta)) if zeta < 1.0 else 1.0
    largest = 0.0
    for phase in range(_PHASES):
        largest = max(largest, _rebound_from(law, law.system_delay.period * phase / _PHASES))
    return _MARGIN * largest
