"""A restless head: while the stick is in it, a random force that changes every hold_s seconds.

Uniform in -force .. force and drawn from a counter and the seed, so that a run can be repeated and does not depend on
how it is split. Piecewise constant: `exact` covers it. Kernels: tick thread; no allocation.
"""

import math
from dataclasses import dataclass

from drumstick.parameters.declare import count, number
from drumstick.stick.effects.random_numbers import uniform
from drumstick.stick.effects.triggers import ON_ENTRY, ON_EXIT
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Record

_DUE_S = 1e-15  # what rounding may leave of a time that is over


@dataclass(frozen=True)
class Noise:
    """`[effects.noise]`."""

    force_N: float = number(0.5, 0.0, 100.0, "N", "Largest random force in the head", wire="noise.force")
    hold_s: float = number(
        0.001, 1e-4, 0.1, "s", "How long each random force lasts", wire="noise.hold", scale="log"
    )
    seed: int = count(1, 0, 2**31 - 1, "1", "Start of the random numbers: the same seed gives the same run")


class NoiseLaw(Record):
    """`Noise` in compiled code: by wire names; a choice is its index."""

    force: float
    hold: float
    seed: int


class NoiseState(Record):
    """The force now, the time that it still lasts, and how many were drawn."""

    force_N: float
    left_s: float
    drawn: int


class _Law(Law):
    noise: NoiseLaw


class _Motion(Motion):
    noise: NoiseState


TABLE = Noise
LAW, STATE = NoiseLaw, NoiseState
STRENGTH = "noise.force"
NEVER_REPEATS = True


@njit()
def _draw(law: _Law, motion: _Motion) -> None:
    motion.noise.drawn += 1
    motion.noise.force_N = law.noise.force * (2.0 * uniform(law.noise.seed, motion.noise.drawn) - 1.0)
    motion.noise.left_s = law.noise.hold


@only_with("noise")
def fire(law: _Law, motion: _Motion, when: int) -> None:
    """Draw afresh at entry, be still from exit on."""
    if when == ON_ENTRY:
        _draw(law, motion)
    elif when == ON_EXIT:
        motion.noise.force_N = 0.0


@only_with("noise", otherwise=0.0)
def force(law: _Law, motion: _Motion) -> float:
    """The random force now, N."""
    return motion.noise.force_N


@only_with("noise", otherwise=math.inf)
def due_in(law: _Law, motion: _Motion, in_head: bool) -> float:
    """Seconds until the force changes."""
    return motion.noise.left_s if in_head else math.inf


@only_with("noise")
def elapse(law: _Law, motion: _Motion, duration: float) -> None:
    """Count the hold down."""
    motion.noise.left_s -= duration


@only_with("noise")
def renew(law: _Law, motion: _Motion, in_head: bool) -> None:
    """Draw again if the hold is over."""
    if in_head and motion.noise.left_s <= _DUE_S:
        _draw(law, motion)


@only_with("noise", otherwise=0.0)
def max_force(law: _Law) -> float:
    """The largest force it can have, N."""
    return law.noise.force


@only_with("noise", otherwise=True)
def usable(law: _Law) -> bool:
    """True when its numbers are fit for a device."""
    return 0.0 <= law.noise.force < 1e6 and 0.0 < law.noise.hold < 1e3


@only_with("noise", otherwise=False)
def can_add_energy(law: _Law) -> bool:
    """True when it may give the stick energy."""
    return law.noise.force > 0.0


@only_with("noise", otherwise=False)
def can_move_resting_stick(law: _Law) -> bool:
    """Any force moves a stick that lies still."""
    return law.noise.force > 0.0


@only_with("noise", otherwise=False)
def varies_at_rest(law: _Law) -> bool:
    """True when its force may change although nothing happens."""
    return law.noise.force > 0.0
