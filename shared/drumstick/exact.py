"""The method `exact`: closed-form motion between events, events found as roots. There is no time step.

`advance` moves the stick to the next event or to a horizon, whichever comes first; splitting a run into ticks
gives the same events. An interval is searched on a grid that grows geometrically from the fastest time scale
and is capped by the oscillation, so that no sign change and no grazing minimum falls between two nodes.
Kernels: tick thread or any other; no allocation, no exceptions.
"""

import math

from drumstick.contact import PAPER, force
from drumstick.effects import pulse
from drumstick.segment import fastest_rate, propagate
from realtime.jit import Record, njit

# Where the stick is. LOOSE: still below z = 0, but a head that only pushes has let go of it (`unilateral`).
ABOVE, CONTACT, LOOSE = 0, 1, 2
# What happened. LOOSEN and RESUME are of no concern outside, but end a closed-form segment.
HORIZON, ENTRY, TURN, RELEASE, APEX, LOOSEN, RESUME = 0, 1, 2, 3, 4, 5, 6
# How a stick can come to its end.
MOVING, CAPTURED, LEFT = 0, 1, 2

_Z, _V, _PUSH, _PUSH_RATE = 0, 1, 2, 3  # the functions whose roots are events
_GROWTH = 1.6
_STEP_PER_RADIAN = 0.3
_FIRST_STEP = 0.1
_HALVINGS = 200
_STILL_M_PER_S = 1e-30

# The constants of a closed-form motion: a, w2, g, lam of drumstick.segment, and the start z, v, p.
Segment = tuple[float, float, float, float, float, float, float]

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
def _value(which: int, law: Record, seg: Segment, t: float) -> tuple[float, float]:
    # The event function and its time derivative, at t.
    a, w2, g, lam, z0, v0, p0 = seg
    z, v, p = propagate(a, w2, g, lam, z0, v0, p0, t)
    if which == _Z:
        return z, v
    acceleration = g - 2.0 * a * v - w2 * z + p
    if which == _V:
        return v, acceleration
    r_head = law.r_in - law.r_out
    push_rate = -law.k_coll * v - r_head * acceleration
    if which == _PUSH:
        return force(law.k_coll, r_head, z, v), push_rate
    jerk = -2.0 * a * acceleration - w2 * v - lam * p
    return push_rate, -law.k_coll * acceleration - r_head * jerk


@njit()
def _root(which: int, law: Record, seg: Segment, low: float, high: float, sign_high: float) -> float:
    # The root of the event function in (low, high]; its sign at `high` is given. Newton, kept inside by
    # bisection.
    t = 0.5 * (low + high)
    for _ in range(_HALVINGS):
        value, slope = _value(which, law, seg, t)
        if value * sign_high >= 0.0:
            high = t
        else:
            low = t
        step = value / slope
        newton = t - step
        if not (low < newton < high):
            newton = 0.5 * (low + high)
        if abs(newton - t) <= 2e-16 * t or high - low <= 2e-16 * high:
            return newton
        t = newton
    return t


@njit()
def _root_after_start(which: int, law: Record, seg: Segment, high: float, sign_high: float) -> float:
    # As _root on (0, high], where the function is zero at the start and leaves zero with the opposite sign
    # first.
    low = 0.5 * high
    for _ in range(_HALVINGS):
        if _value(which, law, seg, low)[0] * sign_high < 0.0:
            return _root(which, law, seg, low, high, sign_high)
        high = low
        low *= 0.5
    return 0.0


@njit()
def _first_step(seg: Segment) -> float:
    a, w2, g, lam, z, v, p = seg
    step = _FIRST_STEP / max(fastest_rate(a, w2, lam if p != 0.0 else 0.0), 1e-9)
    acceleration = g - 2.0 * a * v - w2 * z + p
    if v * acceleration < 0.0:  # it will turn: a quick pulse can throw it back before anything else happens
        step = min(step, 0.25 * abs(v / acceleration))
    return max(step, 1e-15)


@njit()
def _search(law: Record, motion: Record, seg: Segment, horizon: float) -> tuple[int, float]:
    """The first event after the start, and its time; (HORIZON, horizon) when there is none. Notes peak_N."""
    a, w2, g, lam, z0, v0, p0 = seg
    place = motion.place
    r_head = law.r_in - law.r_out
    cap = math.inf if w2 <= a * a else _STEP_PER_RADIAN / math.sqrt(w2 - a * a)
    t = 0.0
    step = _first_step(seg)
    started = False  # past the first node: only then do the start's own zeros count as signs
    v = v0
    push_rate = -law.k_coll * v0 - r_head * (g - 2.0 * a * v0 - w2 * z0 + p0)
    while t < horizon:
        after = min(t + step, horizon)
        z_next, v_next, p_next = propagate(a, w2, g, lam, z0, v0, p0, after)
        acceleration = g - 2.0 * a * v_next - w2 * z_next + p_next
        push_rate_next = -law.k_coll * v_next - r_head * acceleration
        event, when = HORIZON, horizon
        if place == ABOVE:
            if z_next <= 0.0:
                event = ENTRY
                when = (
                    _root(_Z, law, seg, t, after, -1.0)
                    if started
                    else _root_after_start(_Z, law, seg, after, -1.0)
                )
            elif v < 0.0 and v_next > 0.0:  # a minimum above the head: did it graze?
                low = _root(_V, law, seg, t, after, 1.0)
                if _value(_Z, law, seg, low)[0] <= 0.0:
                    event, when = ENTRY, _root(_Z, law, seg, t, low, -1.0)
            if v > 0.0 and v_next <= 0.0:
                top = _root(_V, law, seg, t, after, -1.0)
                if (top < when or event == HORIZON) and (started or top > 0.0):
                    event, when = APEX, top
        elif place == CONTACT:
            which = _Z if law.release == PAPER else _PUSH
            outward = 1.0 if law.release == PAPER else -1.0  # the sign of the event function beyond release
            value = z_next if law.release == PAPER else force(law.k_coll, r_head, z_next, v_next)
            if value * outward >= 0.0:
                event = RELEASE if law.release == PAPER else LOOSEN
                when = (
                    _root(which, law, seg, t, after, outward)
                    if started
                    else _root_after_start(which, law, seg, after, outward)
                )
            else:
                toward = v if law.release == PAPER else -push_rate
                toward_next = v_next if law.release == PAPER else -push_rate_next
                if toward > 0.0 and toward_next < 0.0:  # nearest to release inside the step: did it touch?
                    rate_of = _V if law.release == PAPER else _PUSH_RATE
                    near = _root(rate_of, law, seg, t, after, -outward)
                    if _value(which, law, seg, near)[0] * outward >= 0.0:
                        event = RELEASE if law.release == PAPER else LOOSEN
                        when = _root(which, law, seg, t, near, outward)
            if v < 0.0 and v_next >= 0.0:
                turn = _root(_V, law, seg, t, after, 1.0)
                if turn < when or event == HORIZON:  # also when it falls on the horizon itself
                    event, when = TURN, turn
            if push_rate > 0.0 and push_rate_next <= 0.0:
                peak = _root(_PUSH_RATE, law, seg, t, after, -1.0)
                if peak < when:  # noted in passing: it ends no segment
                    motion.peak_N = max(motion.peak_N, _value(_PUSH, law, seg, peak)[0])
        else:
            if z_next >= 0.0:
                event, when = RELEASE, _root(_Z, law, seg, t, after, 1.0)
            # Just after letting go the push falls from 0; only a start in the middle of the gap may see it rise.
            if force(law.k_coll, r_head, z_next, v_next) > 0.0 and (started or push_rate > 0.0):
                again = _root(_PUSH, law, seg, t, after, 1.0)
                if again < when or event == HORIZON:
                    event, when = RESUME, again
        if event != HORIZON and when <= after:
            return event, when
        v, push_rate = v_next, push_rate_next
        t = after
        started = True
        step = min((_GROWTH - 1.0) * t + step * 1e-3, cap)
    return HORIZON, horizon


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
    if push != 0.0:
        reach += abs(push) / (pulse.rate(law) * w)
    return reach < -rest


@njit()
def _never_returns(law: Record, motion: Record) -> bool:
    lam = pulse.rate(law)
    p = pulse.push(law, motion)
    gain = p / lam if lam > 0.0 else 0.0
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
        event, duration = _search(law, motion, seg, horizon - moved)
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
