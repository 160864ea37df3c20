"""From one segment to the next: which equation holds now, and what an event changes.

Every method goes through this code, so `exact` and the steppers differ only in how they carry the stick along a
segment. Kernels: tick thread or any other; no allocation, no exceptions.
"""

import math

from drumstick.stick import composition
from drumstick.stick.contact import PAPER
from drumstick.stick.effects import triggers
from drumstick.stick.motion.events import (
    ABOVE,
    APEX,
    CONTACT,
    DESCENT,
    ENTRY,
    RECONTACT,
    RELEASE,
    SEPARATED,
    SEPARATION,
    TURN,
    head_force_of,
)
from drumstick.stick.records import Law, Motion
from drumstick.stick.segment import Segment
from realtime.kernels.jit import njit

# How a stick can come to its end.
MOVING, CAPTURED, LEFT = 0, 1, 2

_STILL_M_PER_S = 1e-30
_RUNAWAY_M_PER_S = (
    1e6  # an effect that adds energy without end: the stick has left long before numbers overflow
)


@njit()
def head_force(law: Law, motion: Motion) -> float:
    """Force of the head now, N, if nothing delays it; a head that only pushes never pulls."""
    if motion.contact_phase == ABOVE:
        return 0.0
    k, r, f = composition.head(law, motion)
    push = -k * motion.z - r * motion.v + f
    return push if law.release == PAPER else max(push, 0.0)


@njit()
def force_now(law: Law, motion: Motion) -> float:
    """The force that really acts on the stick, N: the head's, or the held sample of a system with delay."""
    if composition.sampled(law):
        return composition.held(law, motion)
    return head_force(law, motion)


@njit()
def segment_of(law: Law, motion: Motion, method: int | None) -> Segment:
    """The equation that holds from here on, while nothing happens."""
    if composition.sampled(law):
        k, r, f = 0.0, 0.0, composition.held(law, motion)
        acting, release = True, PAPER
    else:
        k, r, f = composition.head(law, motion)
        acting, release = motion.contact_phase == CONTACT, law.release
    stiffness, force = law.k_hand, law.k_hand * law.z_ss
    damping = law.r_out - composition.removed_hand_damping(law, motion)
    if acting:
        stiffness += k
        damping += r
        force += f
    pulses = composition.pulses(law, motion)
    m = law.m
    return Segment(
        0.5 * damping / m, stiffness / m, force / m, motion.z, motion.v, pulses, k, r, f, release, method
    )


@njit()
def begin(law: Law, motion: Motion, method: int | None) -> Segment:
    """`segment_of`, to be moved along: inside it the search sees the push peak, at its ends `begin` and `move` do.

    A force that steps, or a negative damper, peaks at an end. Above the head an effect may alter the flight.
    """
    if motion.contact_phase == ABOVE:
        composition.fly(law, motion)
    seg = segment_of(law, motion, method)
    if motion.contact_phase == CONTACT:
        motion.peak_N = max(motion.peak_N, head_force_of(seg, seg.z, seg.v))
    return seg


@njit()
def move(
    law: Law, motion: Motion, seg: Segment, duration: float, fades: composition.Fades, z: float, v: float
) -> None:
    """The stick is now at (z, v), `duration` seconds along its segment: keep the contact's impulse and time.

    fades: `composition.fades` of this duration.
    """
    before = composition.remaining_speed(law, motion)
    composition.elapse(law, motion, duration, fades)
    if motion.contact_phase == CONTACT:
        travel = z - seg.z
        motion.impulse_N_s += seg.f * duration - seg.r * travel
        if seg.k != 0.0:
            # The integral of z follows from the equation of motion: what the change of speed does not owe to the rest.
            given = before - composition.remaining_speed(law, motion)
            z_integral = (given - (v - seg.v) - 2.0 * seg.a * travel + seg.g * duration) / seg.w2
            motion.impulse_N_s -= seg.k * z_integral
        motion.peak_N = max(motion.peak_N, head_force_of(seg, z, v))
    if motion.contact_phase != ABOVE:
        motion.contact_s += duration
    motion.z = z
    motion.v = v


@njit()
def _turns(motion: Motion, a: float, w: float, rest: float) -> bool:
    # Does a contact come to a deepest point, if no pulse runs? Overdamped, it may creep down to its rest instead.
    if a < w or motion.contact_phase != CONTACT:
        return True
    fastest = a + math.sqrt(a * a - w * w)
    return motion.z < rest or motion.v < -fastest * (motion.z - rest)


@njit()
def never_releases(law: Law, motion: Motion) -> bool:
    """True when nothing can bring the stick out of the head again.

    Energy about the point of rest in the head, with all that a pulse can still add, cannot reach z = 0. A head that
    lets go and meets the stick again higher up only takes energy away.
    """
    if composition.can_add_energy(law, motion):
        return False
    k, r, f = composition.head(law, motion)
    stiffness = law.k_hand + k
    rest = (law.k_hand * law.z_ss + f) / stiffness
    w = math.sqrt(stiffness / law.m)
    left = composition.most_remaining_speed(law, motion)
    if left > 0.0 or _turns(motion, 0.5 * (r + law.r_out) / law.m, w, rest):
        left += composition.pending_speed(law, motion)
    # Within 1e-6 of critical the speed left at z = 0 is below e^-2000 of what came in.
    overdamped = r + law.r_out >= 2.0 * law.m * w * (1.0 - 1e-6)
    if law.release == PAPER and overdamped and left == 0.0 and motion.z <= rest <= 0.0 and motion.v >= 0.0:
        return True  # it creeps up to its rest and never passes it
    return math.hypot(motion.z - rest, motion.v / w) + left / w < -rest


@njit()
def _never_returns(law: Law, motion: Motion) -> bool:
    if composition.still_pushes(law, motion):
        return False
    most = composition.most_remaining_speed(law, motion)
    if law.k_hand == 0.0:
        down = 0.5 * (
            most - composition.remaining_speed(law, motion)
        )  # a push up may come too late to make up for it
        return motion.v >= down
    w = math.sqrt(law.k_hand / law.m)
    reach = math.hypot(motion.z - law.z_ss, motion.v / w)
    return reach + most / w < law.z_ss


@njit()
def _hold(law: Law, motion: Motion) -> None:
    # After an effect has changed the head's force: one that only pushes holds the stick just while it would push.
    if law.release != PAPER and not composition.sampled(law):
        k, r, f = composition.head(law, motion)
        motion.contact_phase = CONTACT if -k * motion.z - r * motion.v + f >= 0.0 else SEPARATED


@njit()
def _lies_still(law: Law, motion: Motion) -> bool:
    # Decayed to nothing at z = 0, and nothing presses or lifts it. A stick that creeps up to its rest there never
    # arrives; its crossing, when its numbers have become too small to tell a sign, is no strike that fires a pulse.
    return (
        abs(motion.v) < _STILL_M_PER_S
        and law.k_hand * law.z_ss == 0.0
        and composition.most_remaining_speed(law, motion) <= _STILL_M_PER_S
        and not composition.can_move_resting_stick(law, motion, _STILL_M_PER_S)
    )


@njit()
def _enter(law: Law, motion: Motion) -> None:
    motion.contact_phase = CONTACT
    motion.v_in = motion.v
    motion.v_out = 0.0
    motion.z_min = min(motion.z, 0.0)
    motion.peak_N = 0.0
    motion.impulse_N_s = 0.0
    motion.contact_s = 0.0
    motion.turned = 0
    if _lies_still(law, motion):
        motion.outcome = CAPTURED
        return
    composition.fire(law, motion, triggers.ON_ENTRY)
    _hold(law, motion)  # R_in < R_out, or a force that pulls: a head that only pushes does not push yet


@njit()
def _turn(law: Law, motion: Motion) -> None:
    motion.z_min = min(motion.z_min, motion.z)
    if motion.turned == 0:
        composition.fire(law, motion, triggers.ON_TURN)
        motion.turned = 1
    else:
        composition.fire(law, motion, triggers.ON_RISE)
    _hold(law, motion)
    if never_releases(law, motion):
        motion.outcome = CAPTURED


@njit()
def _leave(law: Law, motion: Motion) -> None:
    if _lies_still(law, motion):
        motion.outcome = CAPTURED
        return
    motion.contact_phase = ABOVE
    motion.v_out = motion.v
    motion.z_apex = max(motion.z, 0.0)
    composition.fire(law, motion, triggers.ON_EXIT)
    if _never_returns(law, motion):
        motion.outcome = LEFT


@njit()
def apply(law: Law, motion: Motion, event: int) -> None:
    """Apply the event: to the contact's phase and record, the effects, the stick's outcome."""
    if event == ENTRY:
        _enter(law, motion)
    elif event == TURN:
        _turn(law, motion)
    elif event == RELEASE:
        _leave(law, motion)
    elif event == APEX:
        motion.z_apex = motion.z
        if _never_returns(law, motion):
            motion.outcome = LEFT
    elif event == SEPARATION:
        motion.contact_phase = SEPARATED
    elif event == RECONTACT:
        motion.contact_phase = CONTACT
    elif event == DESCENT:
        composition.fire(law, motion, triggers.ON_DESCENT)
        _hold(law, motion)
    if not abs(motion.v) < _RUNAWAY_M_PER_S:
        motion.outcome = LEFT


@njit()
def renew(law: Law, motion: Motion) -> None:
    """Let effects act whose time has come although nothing happened."""
    composition.renew(law, motion, motion.contact_phase != ABOVE, head_force(law, motion))
    if motion.contact_phase != ABOVE and composition.varies_at_rest(law):
        _hold(law, motion)
