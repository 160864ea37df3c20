"""The first event on a segment of motion, and its time.

Between two nodes (drumstick.stick.motion.spans) z' and the rate of the head's push change their sign at most once each,
so z and the push are monotone between these changes: comparing signs finds every event. Kernels: any thread; no
allocation, no exceptions.
"""

from drumstick.stick.contact import PAPER
from drumstick.stick.methods.carry import is_exact
from drumstick.stick.motion.crossing import (
    Point,
    Weights,
    changes,
    point_after,
    root,
    start_of,
    stay,
    weighted,
)
from drumstick.stick.motion.spans import SPEED, cut, first_nodes, head_force_rate, is_brief, later, nearest
from drumstick.stick.records import Motion
from drumstick.stick.segment import Segment
from realtime.kernels.jit import njit

# Where the stick is. SEPARATED: still below z = 0, but a head that only pushes has let go of it (`unilateral`).
ABOVE, CONTACT, SEPARATED = 0, 1, 2
# What happened. SEPARATION, RECONTACT and DESCENT (down again without having left) only matter inside, but end a
# segment.
HORIZON, ENTRY, TURN, RELEASE, APEX, SEPARATION, RECONTACT, DESCENT = 0, 1, 2, 3, 4, 5, 6, 7

_HEIGHT: Weights = (1.0, 0.0, 0.0, 0.0, 0.0)

SegmentEvent = tuple[int, Point]


@njit()
def head_force_of(seg: Segment, z: float, v: float) -> float:
    """Force of the segment's head, N; below 0 it would pull."""
    return -seg.k * z - seg.r * v + seg.f


@njit()
def _head_force(seg: Segment) -> Weights:
    return -seg.k, -seg.r, 0.0, 0.0, seg.f


@njit()
def _rises(here: Point, there: Point) -> bool:
    # The way it first moves; at rest, a start moves the way it is found to move later.
    return here.v > 0.0 or (here.v == 0.0 and there.v > 0.0)


@njit()
def _reach(seg: Segment, here: Point, there: Point) -> Point:
    # Where it meets z = 0 on a monotone way there; at once if it starts there.
    return root(seg, _HEIGHT, here, there) if changes(here.z, there.z) else here


@njit()
def _above(seg: Segment, here: Point, there: Point) -> SegmentEvent:
    turns = changes(here.v, there.v)
    stand = root(seg, SPEED, here, there) if turns else there
    if _rises(here, there):
        return (APEX if turns else HORIZON), stand
    if stand.z <= 0.0:
        return ENTRY, _reach(seg, here, stand)
    return HORIZON, there


@njit()
def _shift(contact_phase: int, seg: Segment, here: Point, bend: Point, end: Point) -> SegmentEvent:
    # SEPARATION when the push of a head that only pushes falls to 0, RECONTACT when it rises above it again. The push
    # is monotone from here to the bend, and from there to the end.
    event, outward = (RECONTACT, 1.0) if contact_phase == SEPARATED else (SEPARATION, -1.0)
    rate = head_force_rate(seg)
    first, last = outward * weighted(rate, here)[0], outward * weighted(rate, end)[0]
    begin, reach = (here, bend) if first > 0.0 or (first == 0.0 and last > 0.0) else (bend, end)
    if reach.t <= begin.t or outward * head_force_of(seg, reach.z, reach.v) < 0.0:
        return HORIZON, end
    if outward * head_force_of(seg, begin.z, begin.v) >= 0.0:
        return event, begin
    return event, root(seg, _head_force(seg), begin, reach)


@njit()
def _lets_go(contact_phase: int, seg: Segment, here: Point, there: Point) -> bool:
    # Does the push of a head that only pushes end between the two? Its rate vanishes once at most, so it ends once.
    if contact_phase != CONTACT or seg.release == PAPER:
        return False
    return head_force_of(seg, here.z, here.v) > 0.0 > head_force_of(seg, there.z, there.v)


@njit()
def _way_end(seg: Segment, here: Point, there: Point, rises: bool) -> SegmentEvent:
    # How a way in the head ends if the head holds: out of it, at a turn, or not before `there`. A rise that ends out of
    # it may turn on the way, and has then passed z = 0 before: no need to know when it turns.
    if rises and changes(here.z, there.z):
        return RELEASE, root(seg, _HEIGHT, here, there)
    if changes(here.v, there.v):
        return (DESCENT if rises else TURN), root(seg, SPEED, here, there)
    return HORIZON, there


@njit()
def _in_head(motion: Motion, seg: Segment, here: Point, there: Point) -> SegmentEvent:
    rises, rate = _rises(here, there), head_force_rate(seg)
    event, end = HORIZON, there
    if _lets_go(motion.contact_phase, seg, here, there):
        end = root(seg, _head_force(seg), here, there)
        # Not out yet, not turned yet: it is the first.
        if end.z < 0.0 and (end.v > 0.0 if rises else end.v < 0.0):
            event = SEPARATION
    sure = event == SEPARATION
    if not sure:
        event, end = _way_end(seg, here, there, rises)
    before, after = weighted(rate, here)[0], weighted(rate, end)[0]
    peaks, dips = before > 0.0 >= after, before < 0.0 <= after
    searched = seg.release != PAPER and not sure
    bend = root(seg, rate, here, end) if peaks or (dips and searched) else end
    if searched:
        shift, at = _shift(motion.contact_phase, seg, here, bend, end)
        if shift != HORIZON and (at.t < end.t or (event != TURN and event != DESCENT)):
            event, end = shift, at
    if event != RELEASE and rises and end.z >= 0.0:
        event, end = RELEASE, _reach(seg, here, end)
    if motion.contact_phase == CONTACT and peaks and bend.t <= end.t:  # noted in passing: it ends no segment
        motion.peak_N = max(motion.peak_N, head_force_of(seg, bend.z, bend.v))
    return event, end


@njit()
def _in_span(motion: Motion, seg: Segment, here: Point, there: Point) -> SegmentEvent:
    if motion.contact_phase == ABOVE:
        return _above(seg, here, there)
    return _in_head(motion, seg, here, there)


@njit()
def first_event(motion: Motion, seg: Segment, horizon: float) -> SegmentEvent:
    """The first event within `horizon` seconds and its point; (HORIZON, the last point) when there is none.

    motion: only `contact_phase` is read, and `peak_N` raised when the push peaks on the way. A stepper's segment is one
    span: its horizon is its step.
    """
    here = start_of(seg)
    if not is_exact(seg):
        return _in_span(motion, seg, here, point_after(seg, horizon))
    if here.v == 0.0 and here.z2 == 0.0 and here.z3 == 0.0 and here.z4 == 0.0:
        # At rest; where a negative damper lets motion grow, 0 times infinity would be NaN.
        return _in_span(motion, seg, here, stay(here, horizon))
    if is_brief(seg, horizon):
        return _in_span(motion, seg, here, point_after(seg, horizon))
    nodes = first_nodes(seg, here, motion.contact_phase != ABOVE)
    while here.t < horizon:
        there = point_after(seg, min(horizon, nearest(nodes)))
        for end in cut(seg, here, there):
            if end.t > here.t:
                found = _in_span(motion, seg, here, end)
                if found[0] != HORIZON:
                    return found
            here = end
        nodes = later(nodes, here.t)
    return HORIZON, here
