"""The contact that has just begun, looked at to its end: what the strike's message announces of it.

The exact solver plays it on a copy of the stick's motion, with all that is known at that instant: pulses that act still
or fire in it, both springs, hysteresis, delay, negative damping, the hand as the law has it. A random force is known
too, since its generator is part of the motion. Kernel: tick thread or any other; no allocation, no exceptions.
"""

from typing import NamedTuple

from drumstick.stick import composition, contact
from drumstick.stick.motion import exact
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit
from realtime.records import Records

MAX_S = 0.25  # a stick that is still in the head then lies there, whatever its effects do to it
# Of one contact; more is a force that changes so often that it is no blow. They bound what a look costs a tick.
_MAX_EVENTS, _MAX_SAMPLES = 64, 400


class PredictedContact(NamedTuple):
    """Largest force N, duration s and impulse N s of a contact."""

    peak_N: float
    contact_s: float
    impulse_N_s: float


@njit()
def isolated(law: Law, speed: float) -> PredictedContact:
    """A blow at `speed` m/s without hand, pulse and effects, by closed forms; impulse m v (1 + beta)."""
    back = contact.beta(law.release, law.m, law.k_coll, law.r_in)
    return PredictedContact(
        contact.peak_force(law.m, law.k_coll, law.r_in, speed),
        contact.contact_time(law.release, law.m, law.k_coll, law.r_in),
        law.m * speed * (1.0 + back),
    )


@njit()
def contact_ahead(law: Law, motion: Motion, ahead: Records) -> PredictedContact:
    """Play the contact that `motion` has just entered, at motion.v_in < 0, to its end, under this law.

    One that does not end, because the stick stays in the head, is announced as an isolated blow: what follows is
    pressing, not a blow.
    ahead: shape (1,), of the motion's type, written to.
    """
    ahead[0] = motion
    stick = ahead[0]
    stick.z, stick.v = 0.0, motion.v_in
    left_s = min(MAX_S, _MAX_SAMPLES * composition.sample_period_s(law))
    for _ in range(_MAX_EVENTS):
        if stick.outcome != exact.MOVING:
            break
        what, gone_s = exact.advance(law, stick, left_s)
        left_s -= gone_s
        if what == exact.RELEASE:
            return PredictedContact(stick.peak_N, stick.contact_s, stick.impulse_N_s)
        if what == exact.HORIZON:
            break
    return isolated(law, -motion.v_in)
