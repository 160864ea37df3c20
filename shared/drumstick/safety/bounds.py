"""Upper bounds of a scene's roll: how fast, how hard. The envelope asks them of every set before it reaches a device.

One contact makes of the entry speed u at most e u + b: e is the rebound with everything that multiplies it, b what
pulses, forces and the hand's own pressing add. One flight gives back at most alpha(v) v. While e < 1 and the hand
presses, the flight is taken without loss, v <= b/(1 - e); else the hand's damping must end the growth.

The hand's spring turns height into speed, also in the head: with A^2 = u^2 + (hand's own speed)^2 the sum of both
energies is A^2, a push of dv adds at most dv to A, whenever it comes, and damping only takes from it. Hence bounds of
A hold for u. Kernels: any thread; no allocation.

A slow flight may gain (negative damping above the head): `_after_slow_flight` says up to what.
"""

import math
from typing import NamedTuple

from drumstick.safety import all_effects, contact_bounds
from drumstick.safety.contact_bounds import ContactBound, pressing_speed
from drumstick.stick.records import Law
from drumstick.stick.segment import free_response
from realtime.kernels.jit import njit

UNBOUNDED_M_PER_S = 1e300
_FASTEST_M_PER_S = 100.0  # a roll that still grows at this speed counts as endless
_BISECTIONS = 40
_ROOT_STEPS = 60
_CLOSE = 1e-12
_FINE = 1e-6


@njit()
def hand_speed(law: Law) -> float:
    """The speed (m/s) that the hand's spring alone can give a stick at z = 0: off the head, or into it."""
    return max(math.sqrt(law.k_hand / law.m) * law.z_ss, pressing_speed(law))


class ContactBounds(NamedTuple):
    """An ordinary contact, and one slow enough for negative damping."""

    own: ContactBound
    slow: ContactBound


@njit()
def bounds_of_contact(law: Law) -> ContactBounds:
    """Bounds of one contact under this law; the costly part of every bound."""
    own = contact_bounds.bound_contact(law, law.r_in)
    if all_effects.slow_speed(law) > 0.0:
        return ContactBounds(own, contact_bounds.bound_contact(law, all_effects.slow_damping(law)))
    return ContactBounds(own, own)


@njit()
def _at_least(of: ContactBound, rebound: float) -> ContactBound:
    return ContactBound(max(of.restitution, rebound), of.added_speed, of.force_per_speed, of.static_force)


@njit()
def with_device_restitution(blows: ContactBounds, rebound: float) -> ContactBounds:
    """Like `bounds_of_contact`, on a device that gives back at least `rebound` of a blow's speed."""
    return ContactBounds(_at_least(blows.own, rebound), _at_least(blows.slow, rebound))


@njit()
def _shaken(law: Law) -> float:
    # The speed, m/s, by forces that change: F/m times the time they last. In each half turn damping takes its share of
    # A, so a whole period is twice what any number of turns comes to.
    period = 2.0 * math.pi * math.sqrt(law.m / law.k_coll)
    return all_effects.max_force(law) / law.m * period


@njit()
def speed_by_effects(law: Law, u: float) -> float:
    """The speed, m/s, that all pulses and forces of a contact entered at `u` m/s give."""
    return all_effects.max_added_speed(law) + all_effects.max_speed_factor(law) * u + _shaken(law)


@njit()
def _max_restitution(law: Law, own: ContactBound) -> float:
    # A pulse into the head comes before the head multiplies.
    return own.restitution + all_effects.max_speed_factor(law) * max(own.restitution, 1.0)


@njit()
def _after_slow(law: Law, own: ContactBound, slow: ContactBound, pushed: float) -> float:
    # The fastest after a contact slow enough for negative damping, in which pulses and forces give `pushed` m/s; 0
    # without it. It may last a whole turn.
    below = all_effects.slow_speed(law)
    if below == 0.0:
        return 0.0
    grown = max(slow.restitution, own.restitution, 1.0)
    return slow.restitution * below + slow.added_speed + pressing_speed(law) + grown * grown * pushed


@njit()
def max_restitution(law: Law) -> float:
    """e: the most by which a contact at any speed multiplies it."""
    return _max_restitution(law, contact_bounds.bound_contact(law, law.r_in))


@njit()
def max_restitution_by_head(law: Law) -> float:
    """e without pulses."""
    return contact_bounds.bound_contact(law, law.r_in).restitution


@njit()
def max_added_speed_by_head(law: Law) -> float:
    """b without pulses: the most speed, m/s, that the head itself adds in a contact, whatever its speed."""
    own, slow = bounds_of_contact(law)
    shaken = _shaken(law)
    return max(own.restitution, 1.0) * shaken + own.added_speed + _after_slow(law, own, slow, shaken)


@njit()
def flight_speed(law: Law, v: float, r_out: float) -> float:
    """|v_in| in m/s after a flight that began at v > 0 with R_out, without a push; needs k_hand > 0 and z_ss < 0."""
    a, w2, depth = 0.5 * r_out / law.m, law.k_hand / law.m, -law.z_ss
    # Under the hand's force at z = 0 alone it would be back at 2 v/(w2 depth); spring and damper make it earlier, but
    # not one that pushes along.
    low, high = 0.0, (2.0 * v / (w2 * depth) if a >= 0.0 else math.inf)
    if w2 > a * a:  # and it has passed z = 0 after half a swing about z_ss
        high = min(high, math.pi / math.sqrt(w2 - a * a))
    t = high
    speed = v
    for _ in range(_ROOT_STEPS):
        c, s, s_rate = free_response(a, w2, t)
        z = depth * (c - 1.0) + v * s
        speed = v * s_rate - w2 * depth * s
        if z > 0.0:
            low = t
        else:
            high = t
        newton = t - z / speed
        if abs(newton - t) <= _CLOSE * t:
            break
        t = newton if low < newton < high and speed < 0.0 else 0.5 * (low + high)
    return abs(speed)


@njit()
def _half_swing(law: Law) -> float:
    # What half a swing about z_ss leaves of its amplitude.
    a, w2 = 0.5 * law.r_out / law.m, law.k_hand / law.m
    return math.exp(-math.pi * a / math.sqrt(w2 - a * a)) if w2 > a * a else 0.0


@njit()
def _next_entry(law: Law, own: ContactBound, u: float) -> float:
    # The largest entry speed of the contact after one that was entered at u, with the loss of the flight between them.
    hand = hand_speed(law)
    given = max(own.restitution, 1.0) * speed_by_effects(law, u)
    if law.z_ss < 0.0:
        amplitude = own.restitution * math.hypot(u, hand) + _kept(law, own)
        leaving = math.sqrt(max(amplitude * amplitude - hand * hand, 0.0))
        late = given + (flight_speed(law, leaving, law.r_out) if leaving > 0.0 else 0.0)
        # A short pulse is part of the throw, so the flight takes its share of it too.
        share = 1.0 - law.r_out / law.m * all_effects.time_constant(law)
        if share <= 0.0:
            return late
        amplitude += given / share
        leaving = math.sqrt(max(amplitude * amplitude - hand * hand, 0.0))
        return min(late, flight_speed(law, leaving, law.r_out)) if leaving > 0.0 else 0.0
    # A hand that lifts shortens the contact, down to no loss; it is half a swing at least until the stick is back.
    kept = (
        own.restitution
        if law.z_ss == 0.0
        else max(own.restitution, math.sqrt(all_effects.max_stiffening(law)))
    )
    amplitude = _half_swing(law) * math.hypot(kept * u, hand) + given
    return math.sqrt(max(amplitude * amplitude - hand * hand, 0.0))


@njit()
def _kept(law: Law, own: ContactBound) -> float:
    # What pressing adds to A, not to u.
    hand = pressing_speed(law)
    return max(math.hypot(own.added_speed, hand) - own.restitution * hand, 0.0)


@njit()
def _leaving(law: Law, own: ContactBound, u: float) -> float:
    # After an ordinary contact entered at u: m/s.
    return max(
        u, own.restitution * u + own.added_speed + max(own.restitution, 1.0) * speed_by_effects(law, u)
    )


@njit()
def _settled(law: Law, own: ContactBound) -> float:
    # The fastest without negative damping.
    e = _max_restitution(law, own)
    lifted = law.k_hand * law.z_ss > 0.0
    if e < 1.0 and not lifted:
        return (max(own.restitution, 1.0) * speed_by_effects(law, 0.0) + _kept(law, own)) / (1.0 - e)
    if not (law.k_hand > 0.0 and e < math.inf):
        return UNBOUNDED_M_PER_S
    if _next_entry(law, own, _FASTEST_M_PER_S) >= _FASTEST_M_PER_S:
        return UNBOUNDED_M_PER_S
    # What a flight gives back of a speed falls with that speed, so growth turns into loss at one speed only.
    low, high = 1e-6, _FASTEST_M_PER_S
    for _ in range(_BISECTIONS):
        middle = math.sqrt(low * high)
        if _next_entry(law, own, middle) >= middle:
            low = middle
        else:
            high = middle
    return _leaving(law, own, high)


@njit()
def _pushed(law: Law, growth: float, acceleration: float) -> float:
    # What pulses of so much in all, m/s^2, can add to A. A flight that gains is its free part and the part that each
    # pulse forces, p/(lam^2 + 2 |a| lam + w^2) exp(-lam t), whose A is at most p/hypot(lam, w).
    lasting = all_effects.time_constant(law)
    if growth > 1.0:
        lasting /= math.hypot(1.0, math.sqrt(law.k_hand / law.m) * lasting)
    return acceleration * lasting


@njit()
def grown_amplitude(growth: float, before: float, pushed: float) -> float:
    """The most, m/s, that a flight makes of A: `before` at its start, or what the hand alone swings with.

    growth: of A in half a swing about the hand's rest. The stick is at the head again within a whole swing: the free
    part of a flight that lasts longer swings no farther than the rest of the motion holds it up, one swing before its
    end. pushed: the A that pulses force (`_pushed`), at the start and at the end.
    """
    if growth == 1.0:
        return before + pushed
    return growth * growth * (before + pushed) + pushed


@njit()
def _after_slow_flight(law: Law) -> float:
    # The fastest entry, m/s, after a flight that begins slow enough for another damping; 0 without it. Pulses may
    # multiply the speed of the blow before it, which is at most this one.
    below = all_effects.slow_flight_speed(law)
    if below == 0.0:
        return 0.0
    growth, r_out = all_effects.slow_flight_growth(law), all_effects.slow_flight_damping(law)
    soonest = 0.5 * math.pi * math.sqrt(law.m / (law.k_coll * all_effects.max_stiffening(law) + law.k_hand))
    pushed = _pushed(law, growth, all_effects.max_acceleration(law, soonest))
    share = _pushed(law, growth, all_effects.max_acceleration_per_speed(law, soonest))
    if pushed == 0.0 and share == 0.0 and law.k_hand > 0.0 and law.z_ss < 0.0:
        return flight_speed(law, below, r_out)  # rises with the speed at which the flight begins
    hand = math.sqrt(law.k_hand / law.m) * abs(law.z_ss)
    most = grown_amplitude(growth, math.hypot(below, hand), pushed)
    if share == 0.0:
        return math.sqrt(max(most * most - hand * hand, 0.0))
    share = grown_amplitude(growth, 0.0, share)
    return most / (1.0 - share) if share < 1.0 else UNBOUNDED_M_PER_S


@njit()
def max_roll_speed(law: Law, blows: ContactBounds) -> float:
    """A speed, m/s, that no contact of the roll begins or ends with; UNBOUNDED_M_PER_S when nothing ends the growth."""
    settled, started = (
        _settled(law, blows.own),
        _after_slow(law, blows.own, blows.slow, speed_by_effects(law, all_effects.slow_speed(law))),
    )
    started = max(started, _after_slow_flight(law))
    if not started < UNBOUNDED_M_PER_S:
        return UNBOUNDED_M_PER_S
    if started <= settled:
        return settled
    return started if _max_restitution(law, blows.own) < 1.0 else _leaving(law, blows.own, started)


@njit()
def max_speed_after_throw(law: Law, blows: ContactBounds, roll: float, throw: float) -> float:
    """Like `max_roll_speed`, whose finite result is `roll`, of a stick thrown from z = 0 at `throw` m/s at most.

    A stick faster than the roll loses speed with each contact and flight, so the first one bounds the rest.
    """
    return max(roll, _leaving(law, blows.own, throw)) if throw > 0.0 else roll


@njit()
def _pulses(law: Law, own: ContactBound, speed: float) -> float:
    # A pulse's own force, and what the head answers to it: as to a blow of its speed, or to a steady force.
    stiffness = law.k_coll * all_effects.max_stiffening(law) + law.k_hand
    soonest = 0.5 * math.pi * math.sqrt(law.m / stiffness)
    force = law.m * all_effects.max_acceleration(law, soonest)
    force += law.m * all_effects.max_acceleration_per_speed(law, soonest) * speed
    given = all_effects.max_added_speed(law) + all_effects.max_speed_factor(law) * speed
    return force + min(own.force_per_speed * given, 2.0 * force * max(own.restitution, 1.0) ** 2)


@njit()
def max_contact_force(law: Law, blows: ContactBounds, speed: float) -> float:
    """A force of head and pulses, N, that no contact entered at `speed` m/s or less has.

    The hand's own force on the stick comes on top.
    """
    own, slow = blows
    force = own.force_per_speed * (speed + _shaken(law)) + own.static_force
    below = min(all_effects.slow_speed(law), speed)
    if below > 0.0:
        force = max(force, slow.force_per_speed * (below + _shaken(law)) + slow.static_force)
        own = slow if slow.force_per_speed > own.force_per_speed else own
    return force + all_effects.max_force(law) + _pulses(law, own, speed)


@njit()
def max_entry_speed(law: Law, blows: ContactBounds, fits: float, max_speed: float, max_force: float) -> float:
    """The fastest entry, m/s, after which neither speed nor force passes `max_speed` m/s and `max_force` N.

    `fits` m/s is known to be one: both bounds rise with the speed.
    """
    low, high = fits, max(fits, max_speed)
    for _ in range(_BISECTIONS):
        if high - low <= _FINE * max_speed:
            break
        middle = 0.5 * (low + high)
        if (
            _leaving(law, blows.own, middle) <= max_speed
            and max_contact_force(law, blows, middle) <= max_force
        ):
            low = middle
        else:
            high = middle
    return low
