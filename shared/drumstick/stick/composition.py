"""Composition of a scene's effects, folded in the order of the registry, which is part of the contract.

Each function here calls the function of its name of every effect that the scene names and that has one; its own body
is what remains without any. Kernels: tick thread; no allocation.
"""

import math

from drumstick.stick.effects.registry import EFFECTS
from drumstick.stick.records import Law, Motion
from realtime.kernels.folding import (
    added,
    any_of,
    each,
    folded,
    largest,
    least,
    listed,
    multiplied,
    present,
    sizes_added,
)
from realtime.kernels.jit import njit

# One item for each pulse that the scene names.
Fades = tuple[float, ...]


@folded(EFFECTS, each)
def fire(law: Law, motion: Motion, when: int) -> None:
    """Say to every effect what has just happened (drumstick.stick.effects.triggers)."""


@folded(EFFECTS, added)
def pulses(law: Law, motion: Motion) -> tuple[tuple[float, float], ...]:
    """The pulses that go on now: their acceleration (m/s^2) and the rate at which each fades (1/s)."""
    return ()


@folded(EFFECTS, added)
def remaining_speed(law: Law, motion: Motion) -> float:
    """The speed, m/s, that running pulses still have to give."""
    return 0.0


@folded(EFFECTS, sizes_added, hook="remaining_speed")
def most_remaining_speed(law: Law, motion: Motion) -> float:
    """Like `remaining_speed`, when pulses of opposite sign do not cancel."""
    return 0.0


@folded(EFFECTS, added)
def pending_speed(law: Law, motion: Motion) -> float:
    """The speed, m/s, that pulses will give which the deepest point of the present contact will start."""
    return 0.0


@folded(EFFECTS, multiplied)
def stiffening(law: Law, motion: Motion) -> float:
    """Factor of K_coll now."""
    return 1.0


@folded(EFFECTS, added)
def removed_damping(law: Law, motion: Motion) -> float:
    """Damping taken from R_in now, N s/m."""
    return 0.0


@folded(EFFECTS, added)
def removed_hand_damping(law: Law, motion: Motion) -> float:
    """Damping taken from R_out now, N s/m: above the head only."""
    return 0.0


@folded(EFFECTS, each)
def fly(law: Law, motion: Motion) -> None:
    """Say to every effect that the stick moves on above the head."""


@folded(EFFECTS, largest)
def flight_growth(law: Law, motion: Motion) -> float:
    """By what half a swing of this flight about its rest multiplies its amplitude, at least 1."""
    return 1.0


@folded(EFFECTS, each)
def end_gain(law: Law, motion: Motion) -> None:
    """Let no effect make this flight gain any more."""


@folded(EFFECTS, added)
def force(law: Law, motion: Motion) -> float:
    """Force of the head besides spring and damper now, N."""
    return 0.0


@folded(EFFECTS, any_of)
def sampled(law: Law) -> bool:
    """True when the head's force is a held sample, `held`, which is then all of it."""
    return False


@folded(EFFECTS, added)
def held(law: Law, motion: Motion) -> float:
    """The held sample that acts now, N."""
    return 0.0


@folded(EFFECTS, least)
def sample_period_s(law: Law) -> float:
    """Time between samples of the head's force, s."""
    return math.inf


@folded(EFFECTS, present, hook="stiffening")
def stiffens(law: Law, motion: Motion) -> bool:
    """True when an effect may change K_coll."""
    return False


@folded(EFFECTS, present, hook="removed_damping")
def loses_damping(law: Law, motion: Motion) -> bool:
    """True when an effect may take from R_in."""
    return False


@folded(EFFECTS, present, hook="due_in")
def acts_by_itself(law: Law, motion: Motion, in_head: bool) -> bool:
    """True when an effect acts although nothing happens."""
    return False


@njit()
def head(law: Law, motion: Motion) -> tuple[float, float, float]:
    """The head's k (N/m), r (N s/m) and f (N): it pushes with -k z - r z' + f.

    r is the head's own damping, R_in - R_out: the hand's R_out of equation (1) is still there inside, and R_in of
    equation (2) is what both give together.
    """
    k = law.k_coll * stiffening(law, motion)
    r = law.r_in - removed_damping(law, motion) - law.r_out
    return k, r, force(law, motion)


@folded(EFFECTS, least)
def due_in(law: Law, motion: Motion, in_head: bool) -> float:
    """Seconds until an effect wants to act although nothing happens."""
    return math.inf


@folded(EFFECTS, each)
def renew(law: Law, motion: Motion, in_head: bool, force: float) -> None:
    """Let those whose time has come act; `force` is what the head pushes with now, N."""


@folded(EFFECTS, listed, hook="fade")
def fades(law: Law, duration: float) -> Fades:
    """Share left of each pulse after `duration` seconds: for steps of one length it is computed once."""
    return ()


@folded(EFFECTS, each, own={"fade": "fades"})
def elapse(law: Law, motion: Motion, duration: float, fades: Fades) -> None:
    """`duration` seconds have passed; `fades` as above, for this duration."""


@folded(EFFECTS, any_of)
def can_add_energy(law: Law, motion: Motion) -> bool:
    """True when an effect other than a running pulse may still give the stick energy, without a new contact."""
    return False


@folded(EFFECTS, any_of)
def can_move_resting_stick(law: Law, motion: Motion, least: float) -> bool:
    """True when an effect other than a pulse can give more than `least` m/s to a stick that lies still at z = 0."""
    return False


@folded(EFFECTS, any_of)
def varies_at_rest(law: Law) -> bool:
    """True when the head's force may change although nothing happens."""
    return False


@folded(EFFECTS, any_of)
def still_pushes(law: Law, motion: Motion) -> bool:
    """True when an effect other than a running pulse may still push the stick above the head."""
    return False


@folded(EFFECTS, each)
def keep_speed(law: Law, new_law: Law, motion: Motion) -> None:
    """Keep what running pulses still have to give, before `new_law` takes over."""


@folded(EFFECTS, each)
def stop(law: Law, motion: Motion) -> None:
    """No effect pushes any more."""
