"""A head that gives back more than it took: its spring is stiffer while the stick rises than while it sinks.

At the deepest point z_min the stiffness steps from K_coll to ratio K_coll, which adds (ratio - 1) K_coll z_min^2 / 2;
without damping the coefficient of restitution is sqrt(ratio). Piecewise linear: `exact` covers it. Kernels: tick
thread; no allocation.
"""

from dataclasses import dataclass

from drumstick.parameters.declare import number
from drumstick.stick.effects.triggers import ON_DESCENT, ON_ENTRY, ON_RISE, ON_TURN
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import only_with
from realtime.records import Record


@dataclass(frozen=True)
class HystereticSpring:
    """`[effects.hysteretic_spring]`."""

    # A ratio below 1 would hold the stick still at the turn: friction, which is not what the paper tries.
    ratio: float = number(
        1.5, 1.0, 4.0, "1", "Stiffness while the stick rises, over the stiffness while it sinks",
        wire="hysteretic_spring.ratio",
    )  # fmt: skip


class HystereticSpringLaw(Record):
    """`HystereticSpring` in compiled code: by wire names; a choice is its index."""

    ratio: float


class HystereticSpringState(Record):
    """Direction of the stick in the head: rising or not."""

    rising: int


class _Law(Law):
    hysteretic_spring: HystereticSpringLaw


class _Motion(Motion):
    hysteretic_spring: HystereticSpringState


TABLE = HystereticSpring
LAW, STATE = HystereticSpringLaw, HystereticSpringState
STRENGTH = "hysteretic_spring.ratio"
ALTERS_HEAD = True


@only_with("hysteretic_spring")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """Note which way the stick moves in the head."""
    if when in (ON_TURN, ON_RISE):
        motion.hysteretic_spring.rising = 1
    elif when in (ON_ENTRY, ON_DESCENT):
        motion.hysteretic_spring.rising = 0


@only_with("hysteretic_spring", otherwise=1.0)
def stiffening(law: _Law, motion: _Motion) -> float:
    """Factor of K_coll now."""
    return law.hysteretic_spring.ratio if motion.hysteretic_spring.rising != 0 else 1.0


@only_with("hysteretic_spring", otherwise=1.0)
def max_stiffening(law: _Law) -> float:
    """The most that K_coll is multiplied by."""
    return law.hysteretic_spring.ratio


@only_with("hysteretic_spring", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its number is fit for a device."""
    return 1.0 <= law.hysteretic_spring.ratio < 1e3


@only_with("hysteretic_spring", otherwise=False)
def can_add_energy(law: _Law, motion: _Motion) -> bool:
    """True when it may still give the stick energy in this contact."""
    return law.hysteretic_spring.ratio > 1.0
