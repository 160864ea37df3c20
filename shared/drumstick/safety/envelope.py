"""The joint envelope: which whole sets of parameters may reach a device while someone plays.

Single ranges are not enough (a small m with a large K_coll, or a long roll with little loss, is dangerous only
together). The same compiled judgement runs in two places: in the gateway, which words the refusal, and in the servo,
which trusts nobody. It gates live sets and devices only; `simulate` takes whatever the table's ranges allow.

What a roll, and a throw into it, can come to at most is `drumstick.safety.bounds`; whether a sampled arm comes to rest
in a late head is `drumstick.safety.sampled_contact`. The hand's spring adds its own energy, which depends on where the
stick is when a set takes effect: `drumstick.safety.entry_speed` tells how fast it would meet the head, to be compared
with `Judgement.max_entry_speed`.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.parameters.declare import quantities
from drumstick.parameters.rig import MAX_DELAY_TICKS
from drumstick.parameters.scene import Scene
from drumstick.safety import all_effects, bounds, sampled_contact
from drumstick.safety.bounds import ContactBounds
from drumstick.safety.sampled_contact import Arm, Coefficients, Head
from drumstick.scenes.table import Refusal
from drumstick.stick import composition
from drumstick.stick.effects.registry import EFFECTS, has_no_bound
from drumstick.stick.law import Records
from drumstick.stick.records import Law, field_of
from realtime.kernels.jit import njit, only_with

OK, NOT_FINITE, MASS, NEGATIVE, ENDLESS, SPEED, FORCE, HAND, BUZZ, ACTIVE = 0, 1, 2, 3, 4, 5, 6, 7, 8, 9
THROW = 10
STIFF, LATE, SELF_DRIVEN, COUNT_LIMIT_CYCLE, COUNT_OSCILLATION = 11, 12, 13, 14, 15  # on sampled devices only
FLIGHT = 16  # what alters the flight, on a sampled device or beside a sampled head

# A contact shorter than this is no longer a blow but a buzz, and thousands of strikes a second on the wire.
SHORTEST_CONTACT_S = 2e-4
# Of the limit of speed that a simulated hand may bring an arm to by its own spring: what it pressed into the head comes
# back on top, at most as much again, which makes 1.41 of it; and encoders tell more than the arm moves.
_SPEED_SHARE = 0.65
_OF_EXACT = 3  # limits, the first of all, that the exact stick has too
# The search for a damping that would do: steps by this factor, so many at most, and so many halvings of the last one.
_STEP, _FARTHEST, _REFINEMENTS = 1.5, 14, 5


@dataclass(frozen=True)
class Limits:
    """Limits of the device and the scene's guard, and actions of the simulated player. SI units.

    throw: speed at which a stick that lies dead is thrown again. The rest is for sampled devices: the stiffness that
    they can render; tick, delay and lead of their force; range of the arm's apparent mass, and the stiffest grip of a
    hand, whose damping gets no credit in poles and rebounds; one count of the encoders. period_s 0: the exact stick.
    """

    max_force_N: float
    max_speed_m_per_s: float
    throw_m_per_s: float = 0.0
    stiffness_N_per_m: float = math.inf
    period_s: float = 0.0
    delay_ticks: int = 0
    lead_s: float = 0.0
    lightest_kg: float = 0.0
    heaviest_kg: float = 0.0
    grip_N_per_m: float = 0.0
    resolution_m: float = 0.0

    @classmethod
    def of(cls, scene: Scene) -> "Limits":
        """The limits of a scene's `[guard]` on the exact stick, which its `[hand]` throws."""
        return cls(scene.guard.max_force_N, scene.guard.max_speed_m_per_s, scene.hand.throw_m_per_s)

    @property
    def lag_s(self) -> float:
        """Mean age of a sampled device's force: half a tick and its delay."""
        return (0.5 + self.delay_ticks) * self.period_s

    def record(self) -> npt.NDArray[np.void]:
        """These limits for the kernels, shape (1,). The exact stick's lack what is for sampled devices only: then none
        of the judgement of those is compiled."""
        names = [field.name for field in dataclasses.fields(self)]
        # The other way round, for numba takes a record that begins as another does for its subtype.
        names = names[::-1] if self.period_s > 0.0 else names[:_OF_EXACT]
        found = np.zeros(1, np.dtype([(name, "i8" if name == "delay_ticks" else "f8") for name in names]))
        for name in names:
            found[name] = getattr(self, name)
        return found


class OutOfEnvelope(Refusal):
    """A set of values lies outside the envelope; says which limit it would pass, and what to change.

    The envelope is what a scene may do on its device: top speed and force, no energy without end, no contacts so short
    that they buzz; on a sampled arm also stiffness and damping that it can render (docs/servo.md, docs/safety.md).

    >>> import drumstick as ds
    >>> ds.servo(ds.scene("phantom", dv_pls=2.0), 0.1)
    Traceback (most recent call last):
        ...
    drumstick.safety.envelope.OutOfEnvelope: phantom: the scene itself is outside the envelope: ...
    """


def new_scratch() -> Coefficients:
    """Memory that a judgement writes to. Control thread."""
    return np.zeros(sampled_contact.SCRATCH_SIZE)


class Judgement(NamedTuple):
    """Verdict on a set whatever the stick does: code is OK or the first rule that it breaks.

    max_entry_speed: the highest entry speed, m/s, after which neither speed nor force exceeds its limit. window: ticks
    of the longest window for the speed of a sampled arm.
    """

    code: int
    max_entry_speed: float
    window: int


@njit()
def _with_hand(law: Law, speed: float) -> float:
    return math.hypot(speed, bounds.hand_speed(law))


@njit()
def predicted(law: Law, throw_m_per_s: float) -> tuple[float, float]:
    """Bounds of the speed (m/s; UNBOUNDED_M_PER_S if nothing ends it) and of the force of head and pulses (N).

    Of a roll on the exact stick that begins with such a throw.
    """
    blows = bounds.bounds_of_contact(law)
    speed = bounds.max_roll_speed(law, blows)
    if not speed < bounds.UNBOUNDED_M_PER_S:
        return bounds.UNBOUNDED_M_PER_S, bounds.max_contact_force(law, blows, speed)
    speed = bounds.max_speed_after_throw(law, blows, speed, throw_m_per_s)
    return _with_hand(law, speed), bounds.max_contact_force(law, blows, speed)


@njit()
def _of_numbers(law: Law) -> int:
    if not (0.0 < law.m < 1e3):
        return MASS
    if not (
        0.0 < law.k_coll < 1e9
        and 0.0 <= law.r_in < 1e6
        and 0.0 <= law.k_hand < 1e6
        and 0.0 <= law.r_out < 1e6
    ):
        return NEGATIVE
    if not (abs(law.z_ss) < 1e3 and all_effects.usable(law)):
        return NOT_FINITE
    if not law.r_in >= law.r_out:
        return ACTIVE
    if composition.sampled(law) and all_effects.slow_flight_speed(law) > 0.0:
        return FLIGHT
    stiffest = law.k_coll * all_effects.max_stiffening(law)
    if not math.pi * math.sqrt(law.m / stiffest) >= SHORTEST_CONTACT_S:
        return BUZZ
    return OK


@njit()
def _of_roll(law: Law, limits: Limits, blows: ContactBounds, rebound: float) -> tuple[int, float]:
    # And a speed from which on it stays within the limits, m/s. rebound: the least that a device gives back of a blow.
    if not bounds.hand_speed(law) <= limits.max_speed_m_per_s:
        return HAND, 0.0
    roll = bounds.max_roll_speed(law, blows)
    rendered = (
        bounds.max_roll_speed(law, bounds.with_device_restitution(blows, rebound)) if rebound > 0.0 else roll
    )
    if not rendered < bounds.UNBOUNDED_M_PER_S:
        return ENDLESS, 0.0
    if not _with_hand(law, rendered) <= limits.max_speed_m_per_s:
        return SPEED, 0.0
    # What the motors of an arm push with is cut by its guard, however fast it comes back.
    if not bounds.max_contact_force(law, blows, roll) <= limits.max_force_N:
        return FORCE, 0.0
    thrown = bounds.max_speed_after_throw(law, blows, rendered, limits.throw_m_per_s)
    if not _with_hand(law, thrown) <= limits.max_speed_m_per_s:
        return THROW, 0.0
    if limits.throw_m_per_s > 0.0 and not bounds.max_contact_force(law, blows, thrown) <= limits.max_force_N:
        return THROW, 0.0
    return OK, thrown


@njit()
def _arm(law: Law, limits: Limits, m: float) -> Arm:
    # A head that is sampled itself, as an effect, comes so much later.
    later = all_effects.max_lag_s(law)
    ticks: int = limits.delay_ticks + math.ceil(later / limits.period_s)
    return Arm(m, limits.grip_N_per_m, 0.0, limits.period_s, ticks, limits.lead_s)


@only_with("period_s", otherwise=False)
def _is_sampled(limits: Limits) -> bool:
    return limits.period_s > 0.0


@only_with("period_s", otherwise=(OK, 0.0, sampled_contact.MAX_WINDOW))
def _on_arm(limits: Limits, law: Law, scratch: Coefficients) -> tuple[int, float, int]:
    # A code, what a contact gives back at most, and the longest window for the speed.
    if all_effects.slow_flight_speed(law) > 0.0:
        return FLIGHT, 0.0, 0
    stiffest = law.k_coll * all_effects.max_stiffening(law)
    if not stiffest <= limits.stiffness_N_per_m:
        return STIFF, 0.0, 0
    lightest, heaviest = _arm(law, limits, limits.lightest_kg), _arm(law, limits, limits.heaviest_kg)
    lag_s = (0.5 + lightest.delay_ticks) * limits.period_s
    if not (lightest.delay_ticks <= MAX_DELAY_TICKS and law.r_in - stiffest * lag_s > 0.0):
        return LATE, 0.0, 0
    head = Head(stiffest, law.r_in - law.r_out, law.release)
    window = sampled_contact.widest_window(lightest, heaviest, head, scratch)
    if not window >= 1:
        return SELF_DRIVEN, 0.0, 0
    step = sampled_contact.velocity_step_per_count(lightest, head, window, limits.resolution_m)
    if not step <= sampled_contact.max_velocity_step_per_count(lightest.delay_ticks):
        return COUNT_LIMIT_CYCLE, 0.0, 0
    oscillation = sampled_contact.oscillation_speed_per_count(lightest, head, limits.resolution_m)
    if not oscillation <= sampled_contact.MAX_OSCILLATION_M_PER_S:
        return COUNT_OSCILLATION, 0.0, 0
    slow = sampled_contact.slow_rebound(lightest, heaviest, head, window, limits.resolution_m, scratch)
    if not slow <= sampled_contact.MAX_SLOW_REBOUND:
        return COUNT_LIMIT_CYCLE, 0.0, 0
    # Pulses give their speed to a stick of mass m, and push in truth what the motors move.
    if not law.m <= limits.heaviest_kg:
        return MASS, 0.0, 0
    # At the speeds of a roll the window is two ticks at most: a straight line explains no more.
    return OK, sampled_contact.worst_rebound(heaviest, head, min(window, 2), scratch), window


@njit()
def judge(law: Law, limits: Limits, scratch: Coefficients) -> Judgement:
    """Judge a set: may it reach the device, and what the tick has to know of it.

    Once a revision: 0.3 ms on average, up to 1.1 ms. Written so that a NaN fails every comparison. scratch:
    `new_scratch()`.
    """
    code, rebound, window = _of_numbers(law), 0.0, sampled_contact.MAX_WINDOW
    sampled = _is_sampled(limits)
    if code == OK and sampled:
        code, rebound, window = _on_arm(limits, law, scratch)
    if code != OK:
        return Judgement(code, 0.0, 0)
    blows = bounds.bounds_of_contact(law)
    code, fits = _of_roll(law, limits, blows, rebound)
    if code != OK:
        return Judgement(code, 0.0, 0)
    if sampled:
        most = _SPEED_SHARE * limits.max_speed_m_per_s - bounds.speed_by_effects(law, fits)
        return Judgement(OK, max(most, fits), window)
    max_entry_speed = bounds.max_entry_speed(law, blows, fits, limits.max_speed_m_per_s, limits.max_force_N)
    return Judgement(OK, max_entry_speed, window)


def _accepted_damping(
    law: Records, limits: npt.NDArray[np.void], scratch: Coefficients, factor: float
) -> float:
    # The nearest r_in that is accepted, on the way down (factor < 1) or up; 0 when there is none.
    tried = law.copy()
    refused = taken = float(law["r_in"][0])
    for _ in range(_FARTHEST):
        taken *= factor
        tried["r_in"] = taken
        if judge(tried[0], limits[0], scratch).code == OK:
            break
        refused = taken
    else:
        return 0.0
    for _ in range(_REFINEMENTS):
        tried["r_in"] = middle = math.sqrt(taken * refused)
        if judge(tried[0], limits[0], scratch).code == OK:
            taken = middle
        else:
            refused = middle
    return taken


def _rounded(value: float, down: bool) -> str:
    # Three digits, on the side that is accepted.
    unit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{(math.floor(value / unit) if down else math.ceil(value / unit)) * unit:.3g}"


def _what_to_change(law: Records, limits: npt.NDArray[np.void], scratch: Coefficients) -> str:
    lower = _accepted_damping(law, limits, scratch, 1.0 / _STEP)
    if lower > 0.0:
        return f"lower r_in to {_rounded(lower, down=True)} N s/m"
    higher = _accepted_damping(law, limits, scratch, _STEP)
    if higher > 0.0:
        return f"raise r_in to {_rounded(higher, down=False)} N s/m"
    return "no r_in will do: lower k_coll"


def _lag_ms(law: Records, limits: npt.NDArray[np.void]) -> float:
    # Mean age of the force: half a tick, the device's delay, and that of a head which is sampled itself.
    arm = _arm(law[0], limits[0], 0.0)
    return (0.5 + arm.delay_ticks) * arm.period_s * 1e3


def require(law: Records, limits: Limits) -> None:
    """Raise OutOfEnvelope, in words, when `law` (shape (1,)) lies outside the envelope."""
    record, scratch = limits.record(), new_scratch()
    code = judge(law[0], record[0], scratch).code
    if code != OK:
        raise OutOfEnvelope(_words(law, limits, record, scratch, code))


def _words(
    law: Records, limits: Limits, record: npt.NDArray[np.void], scratch: Coefficients, code: int
) -> str:
    speed, force = predicted(law[0], 0.0)
    thrown, thrown_N = predicted(law[0], limits.throw_m_per_s)
    effects = [name for name in law.dtype.names or () if name in EFFECTS]
    for name in filter(has_no_bound, effects):
        return (
            f"the effect {name} does not say how large its force can be, so no device plays it, only `simulate` and "
            "`analyse`: give its ds.Effect a max_force"
        )
    numbers = [
        field_of(*declared) for name in effects for declared in quantities(EFFECTS[name].TABLE).items()
    ]
    adding = " and ".join(EFFECTS[name].STRENGTH for name in effects)
    softer = ", ".join(filter(None, (adding, "k_coll or k_hand")))
    r_in, k_coll = float(law["r_in"][0]), float(law["k_coll"][0])
    mass = f"an arm of {limits.lightest_kg:.3g} .. {limits.heaviest_kg:.3g} kg"
    words = {
        NOT_FINITE: f"{', '.join(['z_ss', *numbers])}: one of these is not a usable number"
        + "".join(
            f"; {EFFECTS[name].ALSO_NEEDED}" for name in effects if hasattr(EFFECTS[name], "ALSO_NEEDED")
        ),
        MASS: f"m = {law['m'][0]:g} kg must be above 0"
        + (
            f", and at most {limits.heaviest_kg:.3g} kg on {mass}: pulses for a heavier stick throw it too fast"
            if limits.period_s > 0.0
            else ""
        ),
        NEGATIVE: "k_coll must be above 0 N/m; r_in, r_out and k_hand must not be negative",
        ENDLESS: "nothing damps the rebound enough, so contacts would add speed for ever: "
        f"raise r_in or lower {adding or 'k_hand'}",
        SPEED: f"the roll could reach {speed:.3g} m/s, the limit is {limits.max_speed_m_per_s:g} m/s: "
        f"lower {adding or 'k_hand'} or raise r_in",
        FORCE: f"the force on the stick could reach {force:.3g} N, the limit is {limits.max_force_N:g} N: "
        f"lower {softer}, or raise tau or r_in",
        THROW: f"a throw at {limits.throw_m_per_s:g} m/s ([hand] throw_m_per_s) could reach {thrown:.3g} m/s and "
        f"{thrown_N:.3g} N, the limits are {limits.max_speed_m_per_s:g} m/s and {limits.max_force_N:g} N: lower the "
        f"throw in the scene, k_coll or m",
        HAND: f"the hand alone could throw the stick at {bounds.hand_speed(law[0]):.3g} m/s, the limit is "
        f"{limits.max_speed_m_per_s:g} m/s: lower z_ss or k_hand",
        BUZZ: f"a contact would last less than {SHORTEST_CONTACT_S * 1e3:g} ms, a buzz: raise m or lower k_coll",
        STIFF: f"k_coll = {k_coll:g} N/m is stiffer than this device can render, "
        f"{limits.stiffness_N_per_m:g} N/m: lower k_coll",
        FLIGHT: "what alters the flight above the head is played by the exact stick alone, without system_delay: above "
        'the head an arm gets no force. Set negative_damping.r or .below to 0, or where = "inside" in the scene',
        ACTIVE: "r_in must be at least r_out: below that the head's own damper, r_in - r_out, is negative and adds "
        "energy",
    }
    if code == LATE:
        ticks = _arm(law[0], record[0], limits.lightest_kg).delay_ticks
        if ticks > MAX_DELAY_TICKS:
            return (
                f"the force comes {ticks} ticks late, more than the {MAX_DELAY_TICKS} up to which a "
                "held arm can be proved safe: lower the delay of the head or of the device"
            )
        return (
            f"the force comes {_lag_ms(law, record):g} ms late on average; that delay takes k_coll times as much from "
            "the damping r_in: raise r_in, lower k_coll or raise [servo] rate_Hz"
        )
    if code == SELF_DRIVEN:
        return (
            f"k_coll = {k_coll:g} N/m with r_in = {r_in:g} N s/m, rendered {_lag_ms(law, record):g} ms late, would "
            f"keep {mass} moving by itself: {_what_to_change(law, record, scratch)}, or raise [servo] rate_Hz"
        )
    if code == COUNT_OSCILLATION:
        most = sampled_contact.MAX_OSCILLATION_M_PER_S / limits.resolution_m
        return (
            f"k_coll = {k_coll:g} N/m is too stiff for {mass}, which would oscillate by encoder counts of "
            f"{limits.resolution_m * 1e3:g} mm: lower k_coll to {limits.lightest_kg * most * most:.4g} N/m or less"
        )
    if code == COUNT_LIMIT_CYCLE:
        return (
            f"r_in = {r_in:g} N s/m could keep {mass} in a limit cycle of encoder counts of "
            f"{limits.resolution_m * 1e3:g} mm: {_what_to_change(law, record, scratch)}"
        )
    return words[code]
