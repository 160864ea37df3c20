"""A damper that pushes along, where the stick is slow: the head's, or, as the paper has it, the hand's above the head.

"inside": R_in is lowered by r, in contacts that begin slower than a limit. "above": R_out is, in flights that do: such
a flight gives back more speed than it got. Nothing else makes R_out negative. A blow, or a flight, at or above the
limit meets the ordinary damper, so the speed stays bounded; and the damping never falls below -sqrt(m K), a damping
ratio of -1/2, with the spring of the head or of the hand, so that one contact or flight cannot multiply the speed by
more than exp(pi / sqrt(3)) = 6.1 for each half swing. Without a hand's spring nothing brings the stick back, and R_out
stays at or above 0. Piecewise linear: `exact` covers it. Kernels: tick thread; no allocation.
"""

import math
from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, number
from drumstick.stick.effects.triggers import ON_ENTRY
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Record

WHERE = ("inside", "above")
_ABOVE = WHERE.index("above")
# Of a flight: not asked yet; gains; does not. It is asked once, when the stick first moves above the head.
_OPEN, _SLOW, _FAST = 0, 1, 2


@dataclass(frozen=True)
class NegativeDamping:
    """`[effects.negative_damping]`."""

    r_N_s_per_m: float = number(
        2.0, 0.0, 1e3, "N s/m", "What is taken from R_in, or above the head from R_out: more than that gives energy",
        wire="negative_damping.r",
    )  # fmt: skip
    below_m_per_s: float = number(
        0.5, 0.0, 10.0, "m/s", "Only in contacts, or flights, that begin slower than this",
        wire="negative_damping.below",
    )  # fmt: skip
    where: Literal["inside", "above"] = choice(
        "inside", WHERE, "Whose damping: the head's R_in in contact, or the hand's R_out above the head"
    )


class NegativeDampingLaw(Record):
    """`NegativeDamping` in compiled code: by wire names; a choice is its index."""

    r: float
    below: float
    where: int


class NegativeDampingState(Record):
    """Marks of a contact that is slow enough, and of a flight (not asked yet, slow, fast)."""

    active: int
    flight: int


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


@njit()
def lowered_hand(law: _Law) -> float:
    """Damping in a slow flight, N s/m."""
    return max(law.r_out - law.negative_damping.r, -math.sqrt(law.m * law.k_hand))


@njit()
def _is_slow(law: _Law, motion: _Motion) -> bool:
    # This flight, whether it has been asked or is about to begin.
    flight, own = motion.negative_damping.flight, law.negative_damping
    return flight == _SLOW or (flight == _OPEN and own.where == _ABOVE and 0.0 < motion.v < own.below)


@only_with("negative_damping")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """Decide at entry whether this contact is slow enough; the flight before it is over."""
    if when == ON_ENTRY:
        own = law.negative_damping
        motion.negative_damping.active = 1 if own.where != _ABOVE and -motion.v_in < own.below else 0
        motion.negative_damping.flight = _OPEN


@only_with("negative_damping")
def fly(law: _Law, motion: _Motion) -> None:
    """The stick is above the head: decide, if it has just left, whether this flight is slow enough."""
    motion.negative_damping.flight = _SLOW if _is_slow(law, motion) else _FAST


@only_with("negative_damping")
def end_gain(law: _Law, motion: _Motion) -> None:
    """This flight gains no more."""
    motion.negative_damping.flight = _FAST


@only_with("negative_damping")
def stop(law: _Law, motion: _Motion) -> None:
    """Nothing pushes any more; the next flight is asked anew."""
    motion.negative_damping.active = 0
    motion.negative_damping.flight = _OPEN


@only_with("negative_damping", otherwise=0.0)
def removed_damping(law: _Law, motion: _Motion) -> float:
    """Damping taken from R_in now, N s/m."""
    return law.r_in - lowered(law) if motion.negative_damping.active != 0 else 0.0


@only_with("negative_damping", otherwise=0.0)
def removed_hand_damping(law: _Law, motion: _Motion) -> float:
    """Damping taken from R_out now, N s/m."""
    return law.r_out - lowered_hand(law) if motion.negative_damping.flight == _SLOW else 0.0


@only_with("negative_damping", otherwise=False)
def can_add_energy(law: _Law, motion: _Motion) -> bool:
    """True when it may still give the stick energy in this contact."""
    return motion.negative_damping.active != 0 and lowered(law) < 0.0


@only_with("negative_damping", otherwise=False)
def still_pushes(law: _Law, motion: _Motion) -> bool:
    """True when this flight gains: swinging about a hand that lifts, it is back at the head some time."""
    return _is_slow(law, motion) and lowered_hand(law) < 0.0


@only_with("negative_damping", otherwise=1.0)
def flight_growth(law: _Law, motion: _Motion) -> float:
    """By what half a swing of this flight about its rest multiplies its amplitude, at least 1."""
    return slow_flight_growth(law) if _is_slow(law, motion) else 1.0


@only_with("negative_damping", otherwise=0.0)
def slow_damping(law: _Law) -> float:
    """The damping of an active contact, N s/m."""
    return lowered(law)


@only_with("negative_damping", otherwise=0.0)
def slow_speed(law: _Law) -> float:
    """The entry speed, m/s, up to which it is active."""
    return law.negative_damping.below if law.negative_damping.where != _ABOVE else 0.0


@only_with("negative_damping", otherwise=0.0)
def slow_flight_damping(law: _Law) -> float:
    """The damping of a slow flight, N s/m."""
    return lowered_hand(law)


@only_with("negative_damping", otherwise=1.0)
def slow_flight_growth(law: _Law) -> float:
    """By what half a swing of a slow flight about its rest multiplies its amplitude, at least 1."""
    r = lowered_hand(law)
    if not r < 0.0:
        return 1.0
    return math.exp(-math.pi * r / math.sqrt(4.0 * law.m * law.k_hand - r * r))


@only_with("negative_damping", otherwise=0.0)
def slow_flight_speed(law: _Law) -> float:
    """The speed, m/s, below which a flight has this damping; 0 where none has."""
    own = law.negative_damping
    return own.below if own.where == _ABOVE and own.r > 0.0 else 0.0


@only_with("negative_damping", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its numbers are fit for a device."""
    return 0.0 <= law.negative_damping.r < 1e6 and 0.0 <= law.negative_damping.below < 1e3
