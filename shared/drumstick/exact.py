"""The method `exact`: closed-form motion between events, events found as roots. There is no time step.

`advance` moves the stick to the next event or to a horizon, whichever comes first; splitting a run into ticks
gives the same events. Kernels: tick thread or any other; no allocation, no exceptions.
"""

import math

from drumstick.contact import PAPER, force
from drumstick.effects import pulse
from drumstick.events import (
    ABOVE,
    APEX,
    CONTACT,
    ENTRY,
    HORIZON,
    LOOSE,
    LOOSEN,
    RELEASE,
    TURN,
    Segment,
    first_event,
)
from drumstick.segment import propagate
from realtime.jit import Record, njit

# How a stick can come to its end.
MOVING, CAPTURED, LEFT = 0, 1, 2

_STILL_M_PER_S = 1e-30

# The stick's motion: fields of the record, beside those of the scene's effects. `v_in` to `contact_s`
# describe the present or the last contact (z < 0), `turned` is set once in each.
STATE = (
    ("z", "f8"),
    ("v", "f8"),
    ("v_in", "f8"),
    ("v_out", "f8"),
    ("z_min", "f8"),
    ("z_apex", "f8"),
    ("peak_N", "f8"),
    ("impulse_N_s", "f8"),
    ("contact_s", "f8"),
    ("place", "i8"),
    ("turned", "i8"),
    ("fate", "i8"),
)


@njit()
def _segment(law: Record, motion: Record) -> Segment:
    # The motion from here, while nothing happens.
    stiffness, damping = law.k_hand, law.r_out
    if motion.place == CONTACT:
        stiffness, damping = law.k_hand + law.k_coll, law.r_in
    return (
        0.5 * damping / law.m,
        stiffness / law.m,
        law.k_hand * law.z_ss / law.m,
        pulse.rate(law),
        motion.z,
        motion.v,
        pulse.push(law, motion),
    )


@njit()
def _never_releases(law: Record, motion: Record) -> bool:
    # Energy about the point of rest in the head, with all that the pulse can still add, cannot reach z = 0. A
    # head that lets go and meets the stick again higher up only takes energy away.
    stiffness = law.k_hand + law.k_coll
    rest = law.k_hand * law.z_ss / stiffness
    w = math.sqrt(stiffness / law.m)
    push = pulse.push(law, motion)
    # Within 1e-6 of critical the speed left at z = 0 is below e^-2000 of what came in.
    overdamped = law.r_in >= 2.0 * law.m * w * (1.0 - 1e-6)
    if law.release == PAPER and overdamped and push == 0.0 and motion.z <= rest <= 0.0 and motion.v >= 0.0:
        return True  # it creeps up to its rest and never passes it
    reach = math.hypot(motion.z - rest, motion.v / w)
    reach += abs(pulse.left(law, motion)) / w
    return reach < -rest


@njit()
def _never_returns(law: Record, motion: Record) -> bool:
    gain = pulse.left(law, motion)
    if law.k_hand == 0.0:
        return motion.v >= 0.0 and motion.v + gain >= 0.0
    w = math.sqrt(law.k_hand / law.m)
    return math.hypot(motion.z - law.z_ss, motion.v / w) + abs(gain) / w < law.z_ss


@njit()
def _move(law: Record, motion: Record, seg: Segment, duration: float) -> None:
    """Carry the motion `duration` seconds along its segment, and the contact's impulse with it."""
    a, w2, g, lam, z0, v0, p0 = seg
    z, v, p = propagate(a, w2, g, lam, z0, v0, p0, duration)
    if motion.place == CONTACT:
        # The head's impulse is what the stick's change of momentum does not owe to hand and pulse; the
        # integral of z follows from the equation of motion itself.
        given = (p0 - p) / lam if p0 != 0.0 else 0.0
        z_integral = (given - (v - v0) - 2.0 * a * (z - z0) + g * duration) / w2
        motion.impulse_N_s += -law.k_coll * z_integral - (law.r_in - law.r_out) * (z - z0)
    if motion.place != ABOVE:
        motion.contact_s += duration
    motion.z = z
    motion.v = v
    pulse.elapse(law, motion, p, duration)


@njit()
def _enter(law: Record, motion: Record) -> None:
    motion.place = CONTACT
    motion.z = 0.0
    motion.v_in = motion.v
    motion.v_out = 0.0
    motion.z_min = 0.0
    at_entry = force(law.k_coll, law.r_in - law.r_out, 0.0, motion.v)
    motion.peak_N = max(0.0, at_entry)
    if law.release != PAPER and at_entry < 0.0:
        motion.place = LOOSE  # R_in < R_out: a head that only pushes does not push yet
    motion.impulse_N_s = 0.0
    motion.contact_s = 0.0
    motion.turned = 0
    pulse.fire(law, motion, pulse.ENTRY)
    if abs(motion.v) < _STILL_M_PER_S and law.k_hand * law.z_ss == 0.0 and pulse.push(law, motion) == 0.0:
        motion.fate = CAPTURED  # decayed to nothing, and nothing presses or lifts it


@njit()
def _leave(law: Record, motion: Record) -> None:
    motion.place = ABOVE
    motion.z = 0.0
    motion.v_out = motion.v
    motion.z_apex = 0.0
    pulse.fire(law, motion, pulse.EXIT)
    if _never_returns(law, motion):
        motion.fate = LEFT


@njit()
def advance(law: Record, motion: Record, horizon: float) -> tuple[int, float]:
    """Move to the next event or by `horizon` seconds; returns (event, seconds moved).

    ENTRY: the stick meets the head at z = 0 with motion.v_in < 0. TURN: deepest point. RELEASE: motion.v_out,
    peak_N, impulse_N_s, contact_s, z_min are final. APEX: highest point. HORIZON: none of these within
    `horizon`.
    """
    moved = 0.0
    while True:
        seg = _segment(law, motion)
        event, duration = first_event(law, motion, seg, horizon - moved)
        _move(law, motion, seg, duration)
        moved += duration
        if event == HORIZON:
            if motion.place != ABOVE and _never_releases(law, motion):
                motion.fate = CAPTURED
            return HORIZON, horizon
        if event == ENTRY:
            _enter(law, motion)
            return ENTRY, moved
        if event == APEX:
            motion.v = 0.0
            motion.z_apex = motion.z
            if _never_returns(law, motion):
                motion.fate = LEFT
            return APEX, moved
        if event == TURN:
            motion.v = 0.0
            motion.z_min = min(motion.z_min, motion.z)
            if motion.turned == 0:
                motion.turned = 1
                pulse.fire(law, motion, pulse.TURN)
            if _never_releases(law, motion):
                motion.fate = CAPTURED
            return TURN, moved
        if event == RELEASE:
            _leave(law, motion)
            return RELEASE, moved
        motion.place = LOOSE if event == LOOSEN else CONTACT
