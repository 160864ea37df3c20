"""A head computed too late: its force is sampled every period_s, comes delay_ticks samples later, and is held.

Lag acts as negative damping, about -K_coll (period/2 + delay), and after the release the last force still pushes: the
rebound can be faster than the blow, and depends on where in the period the contact begins. Between samples the force is
constant: `exact` covers it. Kernels: tick thread; no allocation.
"""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import count, number
from drumstick.stick.effects import delayed_contact
from drumstick.stick.effects.delayed_contact import MAX_TICKS
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Record

_DUE_S = 1e-15  # what rounding may leave of a time that is over


@dataclass(frozen=True)
class SystemDelay:
    """`[effects.system_delay]`."""

    period_s: float = number(
        0.001, 1e-4, 0.02, "s", "Time between samples of the head's force", wire="system_delay.period",
        scale="log",
    )  # fmt: skip
    delay_ticks: int = count(1, 0, MAX_TICKS, "samples", "How many samples late the force comes")

    @property
    def mean_lag_s(self) -> float:
        """Mean age of the force, s."""
        return self.period_s * (0.5 + self.delay_ticks)


class SystemDelayLaw(Record):
    """`SystemDelay` in compiled code: by wire names; a choice is its index."""

    period: float
    delay_ticks: int


class SystemDelayState(Record):
    """The force that acts, the time to the next sample, and those on their way."""

    held_N: float
    left_s: float
    next: int
    queue_N: Annotated[npt.NDArray[np.float64], "f8", (MAX_TICKS,)]


class _Law(Law):
    system_delay: SystemDelayLaw


class _Motion(Motion):
    system_delay: SystemDelayState


TABLE = SystemDelay
LAW, STATE = SystemDelayLaw, SystemDelayState
STRENGTH = "system_delay.period"
NEVER_REPEATS = True


@only_with("system_delay", otherwise=False)
def sampled(law: _Law) -> bool:
    """True when the head's force is a held sample."""
    return True


@only_with("system_delay", otherwise=math.inf)
def sample_period_s(law: _Law) -> float:
    """Time between samples of the head's force, s."""
    return law.system_delay.period


@only_with("system_delay", otherwise=0.0)
def max_lag_s(law: _Law) -> float:
    """The oldest that the force can be, s."""
    return law.system_delay.period * (1 + law.system_delay.delay_ticks)


@only_with("system_delay", otherwise=0.0)
def held(law: _Law, motion: _Motion) -> float:
    """The force that acts now, N."""
    return motion.system_delay.held_N


@only_with("system_delay", otherwise=math.inf)
def due_in(law: _Law, motion: _Motion) -> float:
    """Seconds until the next sample."""
    return motion.system_delay.left_s


@only_with("system_delay")
def elapse(law: _Law, motion: _Motion, duration: float) -> None:
    """Count down to the next sample."""
    motion.system_delay.left_s -= duration


@njit()
def _later(state: SystemDelayState, ticks: int, force: float) -> float:
    # The force of `ticks` samples ago; this one goes into the queue.
    if ticks == 0:
        return force
    place = state.next
    came = state.queue_N[place]
    state.queue_N[place] = force
    state.next = place + 1 if place + 1 < ticks else 0
    return came


@only_with("system_delay")
def renew(law: _Law, motion: _Motion, force: float) -> None:
    """Take a sample, the head's force now, if it is due."""
    if motion.system_delay.left_s <= _DUE_S:
        motion.system_delay.left_s = law.system_delay.period
        motion.system_delay.held_N = _later(motion.system_delay, law.system_delay.delay_ticks, force)


@njit()
def _pending(state: SystemDelayState) -> float:
    # All forces acting or on their way, N.
    total = abs(state.held_N)
    for index in range(MAX_TICKS):
        total += abs(state.queue_N[index])
    return total


@only_with("system_delay", otherwise=False)
def still_pushes(law: _Law, motion: _Motion) -> bool:
    """True when a force is acting or on its way."""
    return _pending(motion.system_delay) != 0.0


@only_with("system_delay", otherwise=False)
def can_add_energy(law: _Law) -> bool:
    """Lag acts as negative damping."""
    return True


@only_with("system_delay", otherwise=False)
def can_move_resting_stick(law: _Law, motion: _Motion, least: float) -> bool:
    """True when the forces acting or on their way can give more than `least` m/s."""
    return _pending(motion.system_delay) * law.system_delay.period / law.m > least


@only_with("system_delay")
def stop(law: _Law, motion: _Motion) -> None:
    """Forget every force."""
    motion.system_delay.held_N = 0.0
    for index in range(MAX_TICKS):
        motion.system_delay.queue_N[index] = 0.0


@only_with("system_delay", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its number is fit for a device."""
    return 0.0 < law.system_delay.period < 1e3


@only_with("system_delay", otherwise=(0.0, 0.0, 0.0, 0.0))
def late_blow(law: _Law, r: float, ratio: float) -> tuple[float, float, float, float]:
    """The most that a contact makes of a blow: `delayed_contact`."""
    return delayed_contact.late_blow(law, law.system_delay, r, ratio)
