"""Upper bounds of a scene's roll: how fast, how hard. The envelope asks them of every set before it reaches a device.

One contact makes of the entry speed u at most e u + b: e is the rebound with everything that multiplies it, b what
pulses and forces add. One flight gives back at most alpha(v) v. While e < 1 the flight is taken without loss,
v <= b/(1 - e); above, the hand's damping must end the growth: v <= b + e alpha(v) v. Kernels: any thread; no
allocation.
"""

import math

from drumstick import contact
from drumstick.effects import (
    chaos,
    cor_pulse,
    hysteretic_spring,
    negative_damping,
    noise,
    pulse,
    system_delay,
)
from drumstick.segment import free_response
from realtime.jit import Record, njit

ENDLESS_M_PER_S = 1e300
_FASTEST_M_PER_S = 100.0  # a roll that still grows at this speed counts as endless
_BISECTIONS = 40
_ROOT_STEPS = 12


@njit()
def _rebound(release: int, m: float, k_coll: float, r_in: float) -> float:
    # Also for a damper that pushes along: then both releases end at z = 0.
    if r_in >= 0.0:
        return contact.beta(release, m, k_coll, r_in)
    zeta = max(contact.damping_ratio(m, k_coll, r_in), -0.5)
    return math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta * zeta))


@njit()
def multiplied(law: Record) -> float:
    """e: the most by which a contact at any speed multiplies it."""
    stiffest = hysteretic_spring.stiffest(law)  # a stiffer spring also loses less
    spring = math.sqrt(stiffest)
    own = _rebound(law.release, law.m, law.k_coll * stiffest, law.r_in) * spring
    return max(own, system_delay.rebound(law) * spring) + cor_pulse.multiplies(law)


@njit()
def added(law: Record) -> float:
    """b: the most speed, m/s, that a contact adds whatever its speed.

    A force F in the head adds at most F/m times the time it lasts; the contact may last longer than without it, hence a
    whole period. Negative damping is active only below a speed, so what it can add is bounded too.
    """
    forced = noise.strongest(law) + chaos.strongest(law)
    period = 2.0 * math.pi * math.sqrt(law.m / law.k_coll)
    speed = pulse.adds(law) + forced / law.m * period
    stiffest = hysteretic_spring.stiffest(law)
    grown = _rebound(law.release, law.m, law.k_coll * stiffest, negative_damping.lowest(law))
    return speed + negative_damping.below(law) * grown * math.sqrt(stiffest)


@njit()
def flight_speed(law: Record, v: float) -> float:
    """|v_in| in m/s after a flight that began at v > 0, without a push; needs k_hand > 0 and z_ss < 0."""
    a, w2, depth = 0.5 * law.r_out / law.m, law.k_hand / law.m, -law.z_ss
    # Under the hand's force at z = 0 alone it would be back at 2 v/(w2 depth); spring and damper make it earlier.
    low, high = 0.0, 2.0 * v / (w2 * depth)
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
        t = newton if low < newton < high and speed < 0.0 else 0.5 * (low + high)
    return abs(speed)


@njit()
def fastest(law: Record) -> float:
    """A speed, m/s, that the roll cannot exceed; ENDLESS_M_PER_S when nothing ends its growth."""
    e, b = multiplied(law), added(law)
    if e < 1.0:
        return b / (1.0 - e)
    if e == 1.0 and b == 0.0:
        return 0.0
    if not (law.k_hand > 0.0 and law.z_ss < 0.0 and e < math.inf):
        return ENDLESS_M_PER_S
    if e * flight_speed(law, _FASTEST_M_PER_S) + b >= _FASTEST_M_PER_S:
        return ENDLESS_M_PER_S
    # alpha(v) falls with v, so growth turns into loss at one speed only.
    low, high = 1e-6, _FASTEST_M_PER_S
    for _ in range(_BISECTIONS):
        middle = math.sqrt(low * high)
        if e * flight_speed(law, middle) + b >= middle:
            low = middle
        else:
            high = middle
    return high


@njit()
def blow(law: Record, speed: float) -> float:
    """The head's largest force, N, in a contact entered at `speed` m/s, without hand and pulse."""
    spring = speed * math.sqrt(law.m * law.k_coll)
    force = contact.peak_force(law.m, law.k_coll, law.r_in, speed)
    if negative_damping.lowest(law) < 0.0:  # grows on the way, by e^(pi/sqrt 3) at most
        force = max(force, spring * _rebound(law.release, law.m, law.k_coll, negative_damping.lowest(law)))
    if system_delay.sampled(law):
        force = max(force, spring * (1.0 + system_delay.rebound(law)))
    return force * hysteretic_spring.stiffest(law) + noise.strongest(law) + chaos.strongest(law)


@njit()
def hardest(law: Record, speed: float) -> float:
    """The largest force, N, on the stick in such a contact: head, pulses and hand together."""
    # At most twice the hand's own force, when it is let go suddenly.
    pressing = 2.0 * law.k_hand * abs(law.z_ss)
    pulses = law.m * (pulse.strongest(law) + cor_pulse.strongest(law) * speed)
    return blow(law, speed) + pulses + pressing


@njit()
def usable(law: Record) -> bool:
    """Are the effects' numbers fit for a device? In accept form, so that NaN never passes."""
    return (
        pulse.usable(law)
        and cor_pulse.usable(law)
        and system_delay.usable(law)
        and hysteretic_spring.usable(law)
        and negative_damping.usable(law)
        and noise.usable(law)
        and chaos.usable(law)
    )
