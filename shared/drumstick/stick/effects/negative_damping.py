"""A head whose damper pushes along: R_in is lowered by r, in contacts that begin slower than a limit.

A blow at or above the limit meets the ordinary R_in, so the speed stays bounded; and the damping never falls below
-sqrt(m K_coll), a damping ratio of -1/2, so that one contact cannot multiply the speed by more than
exp(pi / sqrt(3)) = 6.1. Piecewise linear: `exact` covers it. Kernels: tick thread; no allocation.
"""

import math
from dataclasses import dataclass

from drumstick.parameters.declare import number
from drumstick.stick.effects.moments import ENTRY
from realtime.kernels.jit import Record, njit, only_with

STATE = (("active", "i8"),)


@dataclass(frozen=True)
class NegativeDamping:
    """`[effects.negative_damping]`."""

    r_N_s_per_m: float = number(  # noqa: N815  the unit newton is written N
        2.0, 0.0, 1e3, "N s/m", "What is taken from R_in: above R_in the head gives energy",
        wire="negative_damping.r",
    )  # fmt: skip
    below_m_per_s: float = number(
        0.5, 0.0, 10.0, "m/s", "Only in contacts that begin slower than this",
        wire="negative_damping.below",
    )  # fmt: skip


TABLE = NegativeDamping
STRENGTH = "negative_damping.r"
ALTERS_HEAD = True


@njit()
def lowered(law: Record) -> float:
    """Damping in an active contact, N s/m."""
    return max(law.r_in - law.negative_damping.r, -math.sqrt(law.m * law.k_coll))


@only_with("negative_damping")
def fire(law: Record, motion: Record, when: int) -> None:
    """Decide at entry whether this contact is slow enough."""
    if when == ENTRY:
        motion.negative_damping.active = 1 if -motion.v_in < law.negative_damping.below else 0


@only_with("negative_damping", otherwise=0.0)
def removed_damping(law: Record, motion: Record) -> float:
    """What is taken from R_in now, N s/m."""
    return law.r_in - lowered(law) if motion.negative_damping.active != 0 else 0.0


@only_with("negative_damping", otherwise=False)
def can_add_energy(law: Record, motion: Record) -> bool:
    """May it still give the stick energy in this contact?"""
    return motion.negative_damping.active != 0 and lowered(law) < 0.0


@only_with("negative_damping", otherwise=0.0)
def lowest(law: Record) -> float:
    """The damping of an active contact, N s/m."""
    return lowered(law)


@only_with("negative_damping", otherwise=0.0)
def below(law: Record) -> float:
    """The entry speed, m/s, up to which it is active."""
    return law.negative_damping.below


@only_with("negative_damping", otherwise=True)
def usable(law: Record) -> bool:
    """Are its numbers fit for a device?"""
    return 0.0 <= law.negative_damping.r < 1e6 and 0.0 <= law.negative_damping.below < 1e3
