"""The joint envelope: which whole sets of parameters may reach a device while someone plays.

Single ranges are not enough (a small m with a large K_coll, or a long roll with little loss, is dangerous
only together). The same compiled check stands at both fences: the gateway, which words the refusal, and the
servo, which trusts nobody. It gates live sets and devices only; `simulate` takes whatever the table's ranges
allow.

What a roll can come to at most is `drumstick.bounds`. The hand's spring adds its own energy, which depends on where the
stick is when a set takes effect: `safe_from` is the servo's question at that moment.
"""

import math
from dataclasses import dataclass

from drumstick import bounds
from drumstick.effects import hysteretic_spring
from drumstick.law import Records
from drumstick.parameters import Refusal
from drumstick.rig import Guard
from realtime.jit import Record, njit

OK, NOT_FINITE, MASS, NEGATIVE, ENDLESS, SPEED, FORCE, HAND, BUZZ, ACTIVE = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
STIFF, LATE = 10, 11  # on sampled devices only

# A contact shorter than this is no longer a blow but a buzz, and thousands of strikes a second on the wire.
SHORTEST_CONTACT_S = 2e-4

# By which parameter each effect adds energy: what to lower when a set goes too far.
_ADDING = {
    "pulse": "dv_pls",
    "cor_pulse": "gamma",
    "system_delay": "system_delay.period",
    "hysteretic_spring": "hysteretic_spring.ratio",
    "negative_damping": "negative_damping.r",
    "noise": "noise.force",
    "chaos": "chaos.force",
}


@dataclass(frozen=True)
class Limits:
    """What a device and the scene's guard allow.

    A sampled device computes its force `lag_s` late on the mean (T/2 and its own delay), renders no more than
    `stiffness_N_per_m`, and has damping of its own, `damping_N_s_per_m`. The exact stick has no lag and no such limit.
    """

    max_force_N: float  # noqa: N815
    max_speed_m_per_s: float
    stiffness_N_per_m: float = math.inf  # noqa: N815
    lag_s: float = 0.0
    damping_N_s_per_m: float = 0.0  # noqa: N815

    @classmethod
    def of(cls, guard: Guard) -> "Limits":
        """The limits of a scene's `[guard]`."""
        return cls(guard.max_force_N, guard.max_speed_m_per_s)


@njit()
def predicted(law: Record) -> tuple[float, float]:
    """Bounds of the roll's speed (m/s; ENDLESS_M_PER_S if nothing ends it) and of the force on the stick (N)."""
    speed, force = bounds.fastest_and_hardest(law)
    return math.hypot(speed, bounds.hand_speed(law)), force


@njit()
def safe_from(
    law: Record, z: float, v: float, left: float, max_force_N: float, max_speed_m_per_s: float
) -> bool:
    """May `law` take over now? From z >= 0 m at v m/s, with `left` m/s of a pulse still to come.

    A firmer or lower hand turns height into speed: the fastest the stick gets before or at its next contact, and that
    contact's force, must stay within the limits. If not, the set waits; at z = 0 it adds nothing.
    """
    w2 = law.k_hand / law.m
    fastest = v * v + w2 * (z - law.z_ss) ** 2
    if law.z_ss < 0.0:
        fastest -= w2 * law.z_ss * law.z_ss  # the head is met at z = 0, before the spring is at rest
    speed = math.sqrt(max(fastest, 0.0)) + left
    if not speed <= max_speed_m_per_s:
        return False
    return bounds.hardest(law, speed) <= max_force_N


@njit()
def check(law: Record, max_force_N: float, max_speed_m_per_s: float) -> int:
    """OK, or the first rule that the set breaks. Written in accept form, so that NaN never passes."""
    if not (0.0 < law.m < 1e3):
        return MASS
    if not (
        0.0 < law.k_coll < 1e9
        and 0.0 <= law.r_in < 1e6
        and 0.0 <= law.k_hand < 1e6
        and 0.0 <= law.r_out < 1e6
    ):
        return NEGATIVE
    if not (abs(law.z_ss) < 1e3 and bounds.usable(law)):
        return NOT_FINITE
    if not law.r_in >= law.r_out:
        return ACTIVE
    stiffest = law.k_coll * hysteretic_spring.stiffest(law)
    if not math.pi * math.sqrt(law.m / stiffest) >= SHORTEST_CONTACT_S:
        return BUZZ
    if not bounds.hand_speed(law) <= max_speed_m_per_s:
        return HAND
    speed, force = predicted(law)
    if not speed < bounds.ENDLESS_M_PER_S:
        return ENDLESS
    if not speed <= max_speed_m_per_s:
        return SPEED
    if not force <= max_force_N:
        return FORCE
    return OK


@njit()
def check_sampled(law: Record, stiffness: float, lag_s: float, damping: float) -> int:
    """As `check`, what a sampled device asks besides: OK, STIFF or LATE.

    Lag acts as negative damping: passive only while R_in + b - K_coll (T/2 + t_d) > 0. Colgate and Schenkel,
    "Passivity of a class of sampled-data systems: application to haptic interfaces", J. Robotic Systems 14(1), 1997.
    """
    stiffest = law.k_coll * hysteretic_spring.stiffest(law)
    if not stiffest <= stiffness:
        return STIFF
    if lag_s > 0.0 and not law.r_in + damping - stiffest * lag_s > 0.0:
        return LATE
    return OK


def require(law: Records, limits: Limits) -> None:
    """Raise Refusal, in words, when `law` (shape (1,)) lies outside the envelope."""
    code = check(law[0], limits.max_force_N, limits.max_speed_m_per_s)
    if code == OK:
        code = check_sampled(law[0], limits.stiffness_N_per_m, limits.lag_s, limits.damping_N_s_per_m)
    if code == OK:
        return
    speed, force = predicted(law[0])
    effects = [name for name in law.dtype.names or () if name in _ADDING]
    numbers = [field for name in effects for field in law.dtype[name].names or ()]
    adding = " and ".join(_ADDING[name] for name in effects) or "k_hand"
    words = {
        NOT_FINITE: f"{', '.join(['z_ss', *numbers])}: one of these is not a usable number",
        MASS: f"m = {law['m'][0]:g} kg must be above 0",
        NEGATIVE: "k_coll must be above 0 N/m; r_in, r_out and k_hand must not be negative",
        ENDLESS: "nothing damps the rebound enough, so contacts would add speed for ever: "
        f"raise r_in or lower {adding}",
        SPEED: f"the roll could reach {speed:.3g} m/s, the limit is {limits.max_speed_m_per_s:g} m/s: "
        f"lower {adding} or raise r_in",
        FORCE: f"the force on the stick could reach {force:.3g} N, the limit is {limits.max_force_N:g} N: "
        f"lower {adding}, k_coll or k_hand, or raise tau or r_in",
        HAND: f"the hand alone could throw the stick at {bounds.hand_speed(law[0]):.3g} m/s, the limit is "
        f"{limits.max_speed_m_per_s:g} m/s: lower z_ss or k_hand",
        BUZZ: f"a contact would last less than {SHORTEST_CONTACT_S * 1e3:g} ms, a buzz: raise m or lower k_coll",
        STIFF: f"k_coll = {law['k_coll'][0]:g} N/m is stiffer than this device can render, "
        f"{limits.stiffness_N_per_m:g} N/m: lower k_coll",
        LATE: f"the force comes {limits.lag_s * 1e3:g} ms late on the mean, which takes k_coll times that from r_in: "
        "raise r_in, lower k_coll or raise [servo] rate_Hz",
        ACTIVE: "r_in must be at least r_out, or the head would push harder the faster it is left",
    }
    raise Refusal(words[code])
