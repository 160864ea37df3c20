"""The steppers: the stick carried along in steps of fixed length, with and without event location.

`located` cuts a step where something happens, so a method keeps its order through contacts. `unlocated` is what most
force loops do: which equation holds is decided at the start of each step, and an event counts from the end of the step
that saw it. Then every method is of order one, and a stick that is found deep in the head has been given energy.
Kernels: any thread; no allocation, no exceptions.
"""

from drumstick.stick import composition
from drumstick.stick.contact import PAPER
from drumstick.stick.methods.carry import step
from drumstick.stick.motion.advancing import advance
from drumstick.stick.motion.events import (
    ABOVE,
    APEX,
    CONTACT,
    DESCENT,
    ENTRY,
    HORIZON,
    RECONTACT,
    RELEASE,
    SEPARATION,
    TURN,
    head_force_of,
)
from drumstick.stick.motion.transitions import CAPTURED, apply, begin, move, never_releases, renew
from drumstick.stick.records import Law, Motion
from drumstick.stick.segment import Segment, onward
from realtime.kernels.jit import njit

_NEGLIGIBLE = 1e-12  # of a step: what rounding may leave of a horizon that is a whole number of steps


@njit()
def located(law: Law, motion: Motion, horizon: float, method: int, dt: float) -> tuple[int, float]:
    """Like `exact.advance`, by a stepper of steps `dt` s (drumstick.stick.methods.carry): order as its method
    declares."""
    return advance(law, motion, horizon, method, dt)


@njit()
def _seen(contact_phase: int, seg: Segment, z: float, v: float) -> int:
    # What a step that began at the segment's start and ended at (z, v) has passed.
    turned = v if seg.v < 0.0 else -v  # > 0 or = 0 at the end of a step in which the speed changed its sign
    if contact_phase == ABOVE:
        if z < 0.0 or (z == 0.0 and v < 0.0):
            return ENTRY
        return APEX if seg.v > 0.0 and turned >= 0.0 else HORIZON
    if z >= 0.0:
        return RELEASE
    head_force = head_force_of(seg, z, v)
    if contact_phase == CONTACT and seg.release != PAPER and head_force < 0.0:
        return SEPARATION
    if contact_phase != CONTACT and head_force > 0.0:
        return RECONTACT
    if seg.v != 0.0 and turned >= 0.0:
        return TURN if seg.v < 0.0 else DESCENT
    return HORIZON


@njit()
def unlocated(law: Law, motion: Motion, horizon: float, method: int, dt: float) -> tuple[int, float]:
    """Like `exact.advance`, but an event is only noticed at the end of its step: order one, whatever the method."""
    moved = 0.0
    seg, fades = begin(law, motion, method), composition.fades(law, dt)
    while True:
        due = composition.due_in(law, motion, motion.contact_phase != ABOVE)
        left = horizon - moved
        span = min(left, due, dt)
        z, v = step(seg, span)
        move(law, motion, seg, span, fades if span == dt else composition.fades(law, span), z, v)
        moved += span
        event = _seen(motion.contact_phase, seg, z, v)
        if span == due:
            renew(law, motion)
        if event != HORIZON:
            apply(law, motion, event)
            if event not in (SEPARATION, RECONTACT, DESCENT):
                return event, moved
        if left - span <= _NEGLIGIBLE * dt:
            if motion.contact_phase != ABOVE and never_releases(law, motion):
                motion.outcome = CAPTURED
            return HORIZON, horizon
        if event != HORIZON or span == due:
            seg = begin(law, motion, method)
        else:  # the same equation still holds: its coefficients are not computed again
            seg = onward(seg, z, v, composition.pulses(law, motion))
