"""When does something happen? The first event on a closed-form motion, found by bracketing and Newton's method.

An interval is searched on a grid that grows geometrically from the fastest time scale and is capped by the
oscillation, so that no sign change and no grazing minimum falls between two nodes. Kernels: any thread; no
allocation, no exceptions.
"""

import math

from drumstick.contact import PAPER, force
from drumstick.segment import fastest_rate, propagate
from realtime.jit import Record, njit

# Where the stick is. LOOSE: still below z = 0, but a head that only pushes has let go of it (`unilateral`).
ABOVE, CONTACT, LOOSE = 0, 1, 2
# What happened. LOOSEN and RESUME are of no concern outside, but end a closed-form segment.
HORIZON, ENTRY, TURN, RELEASE, APEX, LOOSEN, RESUME = 0, 1, 2, 3, 4, 5, 6

_Z, _V, _PUSH, _PUSH_RATE = 0, 1, 2, 3  # the functions whose roots are events
_GROWTH = 1.6
_STEP_PER_RADIAN = 0.3
_FIRST_STEP = 0.1
_HALVINGS = 200
_ULPS = 2e-16

# The constants of a closed-form motion: a, w2, g, lam of drumstick.segment, and the start z, v, p.
Segment = tuple[float, float, float, float, float, float, float]
# The event functions at one time: z, v, the head's push (N) and its rate.
Node = tuple[float, float, float, float]
# A span of the search: from, to, the nodes there, and whether it lies past the start. Only then do zeros at `from`
# count as signs: a contact begins at z = 0.
Span = tuple[float, float, Node, Node, bool]
Event = tuple[int, float]


@njit()
def _node(law: Record, seg: Segment, t: float) -> Node:
    a, w2, g, lam, z0, v0, p0 = seg
    z, v, p = propagate(a, w2, g, lam, z0, v0, p0, t)
    acceleration = g - 2.0 * a * v - w2 * z + p
    r_head = law.r_in - law.r_out
    return z, v, force(law.k_coll, r_head, z, v), -law.k_coll * v - r_head * acceleration


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
        if abs(newton - t) <= _ULPS * t or high - low <= _ULPS * high:
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
def _first_root(which: int, law: Record, seg: Segment, span: Span, sign_high: float) -> float:
    low, high, _, _, started = span
    if started:
        return _root(which, law, seg, low, high, sign_high)
    return _root_after_start(which, law, seg, high, sign_high)


@njit()
def _earlier(first: Event, second: Event) -> Event:
    # An event on the horizon itself is still an event.
    if first[0] == HORIZON or second[1] < first[1]:
        return second
    return first


@njit()
def _above(law: Record, seg: Segment, span: Span, none: Event) -> Event:
    t, after, here, there, started = span
    found = none
    if there[_Z] <= 0.0:
        found = ENTRY, _first_root(_Z, law, seg, span, -1.0)
    elif here[_V] < 0.0 and there[_V] > 0.0:  # a minimum above the head: did it graze?
        low = _root(_V, law, seg, t, after, 1.0)
        if _value(_Z, law, seg, low)[0] <= 0.0:
            found = ENTRY, _root(_Z, law, seg, t, low, -1.0)
    if here[_V] > 0.0 and there[_V] <= 0.0:
        top = _root(_V, law, seg, t, after, -1.0)
        if started or top > 0.0:
            found = _earlier(found, (APEX, top))
    return found


@njit()
def _letting_go(law: Record, seg: Segment, span: Span, none: Event) -> Event:
    # The end of the head's hold: z rises to 0 (paper), or the push falls to 0 (unilateral).
    t, after, here, there, _ = span
    paper = law.release == PAPER
    which, rate, event, outward = (_Z, _V, RELEASE, 1.0) if paper else (_PUSH, _PUSH_RATE, LOOSEN, -1.0)
    value = there[_Z] if paper else there[_PUSH]
    if value * outward >= 0.0:
        return event, _first_root(which, law, seg, span, outward)
    toward = here[_V] if paper else -here[_PUSH_RATE]
    toward_after = there[_V] if paper else -there[_PUSH_RATE]
    if toward > 0.0 and toward_after < 0.0:  # nearest to it inside the span: did it touch?
        near = _root(rate, law, seg, t, after, -outward)
        if _value(which, law, seg, near)[0] * outward >= 0.0:
            return event, _root(which, law, seg, t, near, outward)
    return none


@njit()
def _in_contact(law: Record, motion: Record, seg: Segment, span: Span, none: Event) -> Event:
    t, after, here, there, _ = span
    found = _letting_go(law, seg, span, none)
    if here[_V] < 0.0 and there[_V] >= 0.0:
        found = _earlier(found, (TURN, _root(_V, law, seg, t, after, 1.0)))
    if here[_PUSH_RATE] > 0.0 and there[_PUSH_RATE] <= 0.0:
        peak = _root(_PUSH_RATE, law, seg, t, after, -1.0)
        if peak < found[1]:  # noted in passing: it ends no segment
            motion.peak_N = max(motion.peak_N, _value(_PUSH, law, seg, peak)[0])
    return found


@njit()
def _loose(law: Record, seg: Segment, span: Span, none: Event) -> Event:
    t, after, here, there, started = span
    found = none
    if there[_Z] >= 0.0:
        found = RELEASE, _root(_Z, law, seg, t, after, 1.0)
    # Just after letting go the push falls from 0; only a start in the middle of the gap may see it rise.
    if there[_PUSH] > 0.0 and (started or here[_PUSH_RATE] > 0.0):
        found = _earlier(found, (RESUME, _root(_PUSH, law, seg, t, after, 1.0)))
    return found


@njit()
def first_event(law: Record, motion: Record, seg: Segment, horizon: float) -> Event:
    """The first event after the start, and its time; (HORIZON, horizon) when there is none.

    motion: only `place` is read, and `peak_N` raised when the push peaks on the way.
    """
    a, w2, _, _, _, _, _ = seg
    none = HORIZON, horizon
    cap = math.inf if w2 <= a * a else _STEP_PER_RADIAN / math.sqrt(w2 - a * a)
    step = _first_step(seg)
    t = 0.0
    here = _node(law, seg, 0.0)
    while t < horizon:
        after = min(t + step, horizon)
        there = _node(law, seg, after)
        span = (t, after, here, there, t > 0.0)
        if motion.place == ABOVE:
            found = _above(law, seg, span, none)
        elif motion.place == CONTACT:
            found = _in_contact(law, motion, seg, span, none)
        else:
            found = _loose(law, seg, span, none)
        if found[0] != HORIZON and found[1] <= after:
            return found
        t, here = after, there
        step = min((_GROWTH - 1.0) * t + step * 1e-3, cap)
    return none
