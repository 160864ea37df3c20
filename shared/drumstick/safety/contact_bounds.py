"""Upper bounds of one contact with the hand on the stick: speed after it, force in it.

The hand's spring stiffens the contact, and presses: a stick that lies on the head with z_ss < 0 sinks in, so a head
that gives energy throws it out even from rest. Kernels: any thread; no allocation.
"""

import math
from typing import NamedTuple

from drumstick.safety import all_effects
from drumstick.stick import composition, contact
from drumstick.stick.contact import PAPER
from drumstick.stick.records import Law
from realtime.kernels.jit import njit


class ContactBound(NamedTuple):
    """An entry at u m/s leaves at most `restitution` u + `added_speed` m/s, and meets at most `force_per_speed` u +
    `static_force` N.
    """

    restitution: float
    added_speed: float
    force_per_speed: float
    static_force: float


@njit()
def pressing_speed(law: Law) -> float:
    """The speed, m/s, that the pressing hand gives the stick on its way to where it rests in the head."""
    pressing = law.k_hand * max(-law.z_ss, 0.0)
    return pressing / math.sqrt(law.m * (law.k_coll + law.k_hand))


@njit()
def _half_turn(law: Law, stiffness: float, r: float) -> float:
    # What half a turn in the head leaves of the speed, or makes of it; `stiffness` is hand and head together, at most.
    if r < 0.0:  # grows most where the turn takes longest
        zeta = contact.damping_ratio(law.m, law.k_coll, r)
        return math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))
    left = contact.beta(law.release, law.m, stiffness, r)
    if law.release != PAPER:
        # A head that only pushes lets go below z = 0; there the hand's spring may still speed the stick up.
        loose = max(r - law.r_out, 0.0) / law.k_coll
        left *= math.sqrt(1.0 + law.k_hand / law.m * loose * loose)
    return min(left, 1.0)


@njit()
def bound_contact(law: Law, r: float) -> ContactBound:
    """A contact with damping r, N s/m, above -sqrt(m K_coll)."""
    ratio = all_effects.max_stiffening(law)
    if composition.sampled(law):
        restitution, added_speed, force_per_speed, static_force = all_effects.late_blow(law, r, ratio)
        return ContactBound(restitution, added_speed, force_per_speed, static_force)
    turn = _half_turn(law, law.k_coll * ratio + law.k_hand, r)
    grown = max(turn, 1.0)
    # From rest at z = 0 a pressed stick makes a whole turn before it is out, and has sunk in twice as far as it rests.
    speed = pressing_speed(law)
    added_speed = speed * math.sqrt(grown**4 * (4.0 * ratio - 3.0) - 1.0)
    spring = math.sqrt(law.m * law.k_coll)
    force_per_speed = spring * math.hypot(1.0, (r - law.r_out) / spring)
    if r >= law.r_out:
        force_per_speed = contact.peak_force(law.m, law.k_coll, r, 1.0)
    worst = ratio * grown * grown
    return ContactBound(
        turn * math.sqrt(ratio),
        added_speed,
        force_per_speed * worst,
        2.0 * law.k_hand * abs(law.z_ss) * worst,
    )
