"""What all of a scene's effects do together, summed in the order of `scene.EFFECTS`, which is part of the contract.

An effect that the scene does not name contributes a constant that the compiler folds away. Kernels: tick thread; no
allocation.
"""

from drumstick.stick.effects import (
    chaos,
    cor_pulse,
    hysteretic_spring,
    negative_damping,
    noise,
    pulse,
    system_delay,
)
from realtime.kernels.jit import Record, njit

Fades = tuple[float, float]


@njit()
def fire(law: Record, motion: Record, when: int) -> None:
    """Tell every effect what has just happened (drumstick.stick.effects.moments)."""
    pulse.fire(law, motion, when)
    cor_pulse.fire(law, motion, when)
    hysteretic_spring.fire(law, motion, when)
    negative_damping.fire(law, motion, when)
    noise.fire(law, motion, when)
    chaos.fire(law, motion, when)


@njit()
def pushes(law: Record, motion: Record) -> tuple[tuple[float, float], ...]:
    """The pulses that go on now: their acceleration (m/s^2) and the rate at which each fades (1/s)."""
    return pulse.pushes(law, motion) + cor_pulse.pushes(law, motion)


@njit()
def left(law: Record, motion: Record) -> float:
    """The speed, m/s, that running pulses still have to give."""
    return pulse.left(law, motion) + cor_pulse.left(law, motion)


@njit()
def left_at_most(law: Record, motion: Record) -> float:
    """As `left`, when pulses of opposite sign do not cancel."""
    return abs(pulse.left(law, motion)) + abs(cor_pulse.left(law, motion))


@njit()
def waiting(law: Record, motion: Record) -> float:
    """The speed, m/s, that pulses will give which the deepest point of the present contact will start."""
    return pulse.waiting(law, motion) + cor_pulse.waiting(law, motion)


@njit()
def head(law: Record, motion: Record) -> tuple[float, float, float]:
    """The head's k (N/m), r (N s/m) and f (N): it pushes with -k z - r z' + f.

    r is the head's own damping, R_in - R_out: the hand's R_out of equation (1) is still there inside, and R_in of
    equation (2) is what both give together.
    """
    k = law.k_coll * hysteretic_spring.factor(law, motion)
    r = law.r_in - negative_damping.taken(law, motion) - law.r_out
    f = noise.force(law, motion) + chaos.force(law, motion)
    return k, r, f


@njit()
def due_in(law: Record, motion: Record, in_head: bool) -> float:
    """Seconds until an effect wants to act although nothing happens."""
    return min(system_delay.due_in(law, motion), noise.due_in(law, motion, in_head))


@njit()
def renew(law: Record, motion: Record, in_head: bool, force: float) -> None:
    """Let those whose time has come act; `force` is what the head pushes with now, N."""
    system_delay.renew(law, motion, force)
    noise.renew(law, motion, in_head)


@njit()
def fades(law: Record, duration: float) -> Fades:
    """What is left of each pulse after `duration` seconds: for steps of one length it is computed once."""
    return pulse.fade(law, duration), cor_pulse.fade(law, duration)


@njit()
def elapse(law: Record, motion: Record, duration: float, fades: Fades) -> None:
    """`duration` seconds have passed; `fades` as above, for this duration."""
    pulse.elapse(law, motion, duration, fades[0])
    cor_pulse.elapse(law, motion, duration, fades[1])
    system_delay.elapse(law, motion, duration)
    noise.elapse(law, motion, duration)


@njit()
def lively(law: Record, motion: Record) -> bool:
    """May an effect other than a running pulse still give the stick energy, without a new contact?"""
    return (
        system_delay.sampled(law)
        or hysteretic_spring.lively(law, motion)
        or negative_damping.lively(law, motion)
        or noise.strongest(law) > 0.0
        or chaos.lively(law, motion)
    )


@njit()
def stirs(law: Record, motion: Record, least: float) -> bool:
    """Can an effect other than a pulse give more than `least` m/s to a stick that lies still at z = 0?"""
    forced = noise.strongest(law) > 0.0 or chaos.strongest(law) > 0.0
    return forced or system_delay.coming(law, motion) > least


@njit()
def restless(law: Record) -> bool:
    """May the head's force change although nothing happens?"""
    return noise.strongest(law) > 0.0


@njit()
def still_pushing(law: Record, motion: Record) -> bool:
    """May an effect other than a running pulse still push the stick above the head?"""
    return system_delay.lively(law, motion)


@njit()
def keep_speed(law: Record, new_law: Record, motion: Record) -> None:
    """Before `new_law` takes over: what running pulses still have to give stays as it is."""
    pulse.keep_speed(law, new_law, motion)
    cor_pulse.keep_speed(law, new_law, motion)


@njit()
def stop(law: Record, motion: Record) -> None:
    """No effect pushes any more."""
    pulse.stop(law, motion)
    cor_pulse.stop(law, motion)
    system_delay.stop(law, motion)
