"""When does something happen? The first event on a segment of motion, found by bracketing and Newton's method.

An interval is searched on a grid that grows geometrically from the fastest time scale and is capped by the
oscillation, so that no sign change and no grazing minimum falls between two nodes. Kernels: any thread; no
allocation, no exceptions.
"""

import math

from drumstick.contact import PAPER
from drumstick.methods.carry import carry, is_exact
from drumstick.segment import Segment, acceleration, fastest_push, fastest_rate, push_now
from realtime.jit import Record, njit

# Where the stick is. LOOSE: still below z = 0, but a head that only pushes has let go of it (`unilateral`).
ABOVE, CONTACT, LOOSE = 0, 1, 2
# What happened. LOOSEN, RESUME and SINK (down again without having left) only matter inside, but end a segment.
HORIZON, ENTRY, TURN, RELEASE, APEX, LOOSEN, RESUME, SINK = 0, 1, 2, 3, 4, 5, 6, 7

_Z, _V, _PUSH, _PUSH_RATE = 0, 1, 2, 3  # the functions whose roots are events
_GROWTH = 1.6
_STEP_PER_RADIAN = 0.3
_FIRST_STEP = 0.1
_HALVINGS = 200
_ULPS = 2e-16

# The event functions at one time: z, v, the head's push (N) and its rate.
Node = tuple[float, float, float, float]
# A span of the search: from, to, the nodes there, and whether it lies past the start. Only then do zeros at `from`
# count as signs: a contact begins at z = 0.
Span = tuple[float, float, Node, Node, bool]
Event = tuple[int, float]


@njit()
def push_of(seg: Segment, z: float, v: float) -> float:
    """What the segment's head pushes with, N; below 0 it would pull."""
    return -seg.k * z - seg.r * v + seg.f


@njit()
def _node(seg: Segment, t: float) -> Node:
    z, v = carry(seg, t)
    return z, v, push_of(seg, z, v), -seg.k * v - seg.r * acceleration(seg, t, z, v)


@njit()
def _value(which: int, seg: Segment, t: float) -> tuple[float, float]:
    # The event function and its time derivative, at t.
    z, v = carry(seg, t)
    if which == _Z:
        return z, v
    z_rate2 = acceleration(seg, t, z, v)
    if which == _V:
        return v, z_rate2
    push_rate = -seg.k * v - seg.r * z_rate2
    if which == _PUSH:
        return push_of(seg, z, v), push_rate
    z_rate3 = -2.0 * seg.a * z_rate2 - seg.w2 * v + push_now(seg.pushes, t)[1]
    return push_rate, -seg.k * z_rate2 - seg.r * z_rate3


@njit()
def _root(which: int, seg: Segment, low: float, high: float, sign_high: float) -> float:
    # The root of the event function in (low, high]; its sign at `high` is given. Newton, kept inside by
    # bisection.
    t = 0.5 * (low + high)
    for _ in range(_HALVINGS):
        value, slope = _value(which, seg, t)
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
def _root_after_start(which: int, seg: Segment, high: float, sign_high: float) -> float:
    # As _root on (0, high], where the function is zero at the start and leaves zero with the opposite sign
    # first.
    low = 0.5 * high
    for _ in range(_HALVINGS):
        if _value(which, seg, low)[0] * sign_high < 0.0:
            return _root(which, seg, low, high, sign_high)
        high = low
        low *= 0.5
    return 0.0


@njit()
def _first_step(seg: Segment) -> float:
    fastest = fastest_rate(seg.a, seg.w2, fastest_push(seg.pushes))
    step = _FIRST_STEP / max(fastest, 1e-9)
    start = acceleration(seg, 0.0, seg.z, seg.v)
    if seg.v * start < 0.0:  # it will turn: a quick pulse can throw it back before anything else happens
        step = min(step, 0.25 * abs(seg.v / start))
    return max(step, 1e-15)


@njit()
def _first_root(which: int, seg: Segment, span: Span, sign_high: float) -> float:
    low, high, _, _, started = span
    if started:
        return _root(which, seg, low, high, sign_high)
    return _root_after_start(which, seg, high, sign_high)


@njit()
def _earlier(first: Event, second: Event) -> Event:
    # An event on the horizon itself is still an event.
    if first[0] == HORIZON or second[1] < first[1]:
        return second
    return first


@njit()
def _above(seg: Segment, span: Span, none: Event) -> Event:
    t, after, here, there, started = span
    found = none
    if there[_Z] <= 0.0:
        found = ENTRY, _first_root(_Z, seg, span, -1.0)
    elif here[_V] < 0.0 and there[_V] > 0.0:  # a minimum above the head: did it graze?
        low = _root(_V, seg, t, after, 1.0)
        if _value(_Z, seg, low)[0] <= 0.0:
            found = ENTRY, _root(_Z, seg, t, low, -1.0)
    if here[_V] > 0.0 and there[_V] <= 0.0:
        top = _root(_V, seg, t, after, -1.0)
        if started or top > 0.0:
            found = _earlier(found, (APEX, top))
    return found


@njit()
def _rising_out(which: int, rate: int, outward: float, event: int, seg: Segment, span: Span) -> Event:
    # The event function reaches 0 from the side of a stick that is held: at the end of the span, or in it and back.
    t, after, here, there, _ = span
    if there[which] * outward >= 0.0:
        return event, _first_root(which, seg, span, outward)
    if here[rate] * outward > 0.0 and there[rate] * outward < 0.0:
        near = _root(rate, seg, t, after, -outward)
        if _value(which, seg, near)[0] * outward >= 0.0:
            return event, _root(which, seg, t, near, outward)
    return HORIZON, after


@njit()
def _turning(seg: Segment, span: Span, found: Event) -> Event:
    t, after, here, there, _ = span
    if here[_V] < 0.0 and there[_V] >= 0.0:
        return _earlier(found, (TURN, _root(_V, seg, t, after, 1.0)))
    if here[_V] > 0.0 and there[_V] <= 0.0:
        return _earlier(found, (SINK, _root(_V, seg, t, after, -1.0)))
    return found


@njit()
def _in_contact(motion: Record, seg: Segment, span: Span, none: Event) -> Event:
    t, after, here, there, _ = span
    found = _rising_out(_Z, _V, 1.0, RELEASE, seg, span)
    if seg.release != PAPER:  # a head that only pushes lets go when its push falls to 0
        loosened = _rising_out(_PUSH, _PUSH_RATE, -1.0, LOOSEN, seg, span)
        if loosened[0] != HORIZON:
            found = _earlier(found, loosened)
    found = _turning(seg, span, found)
    if here[_PUSH_RATE] > 0.0 and there[_PUSH_RATE] <= 0.0:
        peak = _root(_PUSH_RATE, seg, t, after, -1.0)
        if peak < found[1]:  # noted in passing: it ends no segment
            motion.peak_N = max(motion.peak_N, _value(_PUSH, seg, peak)[0])
    return found if found[0] != HORIZON else none


@njit()
def _loose(seg: Segment, span: Span, none: Event) -> Event:
    t, after, here, there, started = span
    found = none
    if there[_Z] >= 0.0:
        found = RELEASE, _root(_Z, seg, t, after, 1.0)
    # Just after letting go the push falls from 0; only a start in the middle of the gap may see it rise.
    if there[_PUSH] > 0.0 and (started or here[_PUSH] < 0.0 or here[_PUSH_RATE] > 0.0):
        found = _earlier(found, (RESUME, _root(_PUSH, seg, t, after, 1.0)))
    return _turning(seg, span, found)


@njit()
def _in_span(motion: Record, seg: Segment, span: Span, none: Event) -> Event:
    if motion.place == ABOVE:
        return _above(seg, span, none)
    if motion.place == CONTACT:
        return _in_contact(motion, seg, span, none)
    return _loose(seg, span, none)


@njit()
def first_event(motion: Record, seg: Segment, horizon: float) -> Event:
    """The first event after the start, and its time; (HORIZON, horizon) when there is none.

    motion: only `place` is read, and `peak_N` raised when the push peaks on the way. A stepper's segment is one span:
    its horizon is its step.
    """
    none = HORIZON, horizon
    if not is_exact(seg):
        return _in_span(motion, seg, (0.0, horizon, _node(seg, 0.0), _node(seg, horizon), False), none)
    discriminant = seg.w2 - seg.a * seg.a
    cap = math.inf if discriminant <= 0.0 else _STEP_PER_RADIAN / math.sqrt(discriminant)
    step = _first_step(seg)
    t = 0.0
    here = _node(seg, 0.0)
    while t < horizon:
        after = min(t + step, horizon)
        there = _node(seg, after)
        found = _in_span(motion, seg, (t, after, here, there, t > 0.0), none)
        if found[0] != HORIZON and found[1] <= after:
            return found
        t, here = after, there
        step = min((_GROWTH - 1.0) * t + step * 1e-3, cap)
    return none
