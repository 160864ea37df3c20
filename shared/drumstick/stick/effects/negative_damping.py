"""A head whose damper pushes along: R_in is lowered by r, in contacts that begin slower than a limit.

A blow at or above the limit meets the ordinary R_in, so the speed stays bounded; and the damping never falls below
-sqrt(m K_coll), a damping ratio of -1/2, so that one contact cannot multiply the speed by more than
exp(pi / sqrt(3)) = 6.1. Piecewise linear: `exact` covers it. Kernels: tick thread; no allocation.
"""

import math
from dataclasses import dataclass

from drumstick.parameters.declare import number
from drumstick.stick.effects.triggers import ON_ENTRY
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Record


@dataclass(frozen=True)
class NegativeDamping:
    """`[effects.negative_damping]`."""

    r_N_s_per_m: float = number(
        2.0, 0.0, 1e3, "N s/m", "What is taken from R_in: above R_in the head gives energy",
        wire="negative_damping.r",
    )  # fmt: skip
    below_m_per_s: float = number(
        0.5, 0.0, 10.0, "m/s", "Only in contacts that begin slower than this",
        wire="negative_damping.below",
    )  # fmt: skip


class NegativeDampingLaw(Record):
    """`NegativeDamping` in compiled code: by wire names; a choice is its index."""

    r: float
    below: float


class NegativeDampingState(Record):
    """Mark of a contact that is slow enough."""

    active: int


class _Law(Law):
    negative_damping: NegativeDampingLaw


class _Motion(Motion):
    negative_damping: NegativeDampingState


TABLE = NegativeDamping
LAW, STATE = NegativeDampingLaw, NegativeDampingState
STRENGTH = "negative_damping.r"
ALTERS_HEAD = True


@njit()
def lowered(law: _Law) -> float:
    """Damping in an active contact, N s/m."""
    return max(law.r_in - law.negative_damping.r, -math.sqrt(law.m * law.k_coll))


@only_with("negative_damping")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """Decide at entry whether this contact is slow enough."""
    if when == ON_ENTRY:
        motion.negative_damping.active = 1 if -motion.v_in < law.negative_damping.below else 0


@only_with("negative_damping", otherwise=0.0)
def removed_damping(law: _Law, motion: _Motion) -> float:
    """Damping taken from R_in now, N s/m."""
    return law.r_in - lowered(law) if motion.negative_damping.active != 0 else 0.0


@only_with("negative_damping", otherwise=False)
def can_add_energy(law: _Law, motion: _Motion) -> bool:
    """True when it may still give the stick energy in this contact."""
    return motion.negative_damping.active != 0 and lowered(law) < 0.0


@only_with("negative_damping", otherwise=0.0)
def slow_damping(law: _Law) -> float:
    """The damping of an active contact, N s/m."""
    return lowered(law)


@only_with("negative_damping", otherwise=0.0)
def slow_speed(law: _Law) -> float:
    """The entry speed, m/s, up to which it is active."""
    return law.negative_damping.below


@only_with("negative_damping", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its numbers are fit for a device."""
    return 0.0 <= law.negative_damping.r < 1e6 and 0.0 <= law.negative_damping.below < 1e3
