"""Unpredictable without chance: at each turn the head adds a force that follows the logistic map.

x <- growth x (1 - x) once a contact; from the deepest point to the release the head pushes with force x in addition.
May, "Simple mathematical models with very complicated dynamics" (1976). Piecewise constant: `exact` covers it. Kernels:
tick thread; no allocation.
"""

from dataclasses import dataclass

from drumstick.parameters.declare import number
from drumstick.stick.effects.triggers import ON_EXIT, ON_TURN
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import only_with
from realtime.records import Record


@dataclass(frozen=True)
class Chaos:
    """`[effects.chaos]`."""

    force_N: float = number(2.0, 0.0, 100.0, "N", "Largest added force", wire="chaos.force")
    growth: float = number(
        3.9, 0.0, 4.0, "1", "Growth of the logistic map: chaotic from 3.57 on", wire="chaos.growth"
    )
    start: float = number(
        0.4, 0.01, 0.99, "1", "Value x of the logistic map before the first contact (not the place x)"
    )


class ChaosLaw(Record):
    """`Chaos` in compiled code: by wire names; a choice is its index."""

    force: float
    growth: float
    start: float


class ChaosState(Record):
    """The map's value, and the force now."""

    x: float
    force_N: float


class _Law(Law):
    chaos: ChaosLaw


class _Motion(Motion):
    chaos: ChaosState


TABLE = Chaos
LAW, STATE = ChaosLaw, ChaosState
STRENGTH = "chaos.force"
NEVER_REPEATS = True


@only_with("chaos")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """One step of the map at the first turn of a contact; no force from exit on."""
    if when == ON_TURN:
        x = motion.chaos.x if motion.chaos.x > 0.0 else law.chaos.start
        motion.chaos.x = law.chaos.growth * x * (1.0 - x)
        motion.chaos.force_N = law.chaos.force * motion.chaos.x
    elif when == ON_EXIT:
        motion.chaos.force_N = 0.0


@only_with("chaos", otherwise=0.0)
def force(law: _Law, motion: _Motion) -> float:
    """The added force now, N."""
    return motion.chaos.force_N


@only_with("chaos", otherwise=0.0)
def max_force(law: _Law) -> float:
    """The largest force it can have, N: the map's largest value is growth/4."""
    return law.chaos.force * 0.25 * law.chaos.growth


@only_with("chaos", otherwise=False)
def can_add_energy(law: _Law, motion: _Motion) -> bool:
    """True when it may still give the stick energy in this contact. Its force comes with the first turn."""
    return motion.turned == 0 and law.chaos.force * law.chaos.growth > 0.0


@only_with("chaos", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its numbers are fit for a device. Above 4 the logistic map leaves 0 .. 1."""
    return 0.0 <= law.chaos.force < 1e6 and 0.0 <= law.chaos.growth <= 4.0


@only_with("chaos", otherwise=False)
def can_move_resting_stick(law: _Law) -> bool:
    """Any force moves a stick that lies still."""
    return law.chaos.force * 0.25 * law.chaos.growth > 0.0
