"""From here to the next event or to a horizon, whichever comes first, by any method that finds its events.

Splitting a run into ticks gives the same events. Kernels: tick thread or any other; no allocation, no exceptions.
"""

from drumstick.stick import composition
from drumstick.stick.motion import energy
from drumstick.stick.motion.events import (
    ABOVE,
    APEX,
    DESCENT,
    ENTRY,
    HORIZON,
    RECONTACT,
    RELEASE,
    SEPARATION,
    TURN,
    first_event,
)
from drumstick.stick.motion.transitions import CAPTURED, apply, begin, move, never_releases, renew
from drumstick.stick.records import Law, Motion
from drumstick.stick.segment import pulses_at_start
from realtime.kernels.jit import njit

_INSTANT_S = 1e-15
_MAX_AT_ONCE = 20
_NOTHING = 1e-30  # m and m/s


@njit()
def _land(motion: Motion, event: int) -> None:
    # At an event its function is 0, with the event's sign of the rate: rounding must not say otherwise.
    if event == ENTRY:
        motion.z = 0.0
        motion.v = min(motion.v, 0.0)
    elif event == RELEASE:
        motion.z = 0.0
        motion.v = max(motion.v, 0.0)
    elif event in (TURN, APEX, DESCENT):
        motion.v = 0.0


@njit()
def _died_away(law: Law, motion: Motion) -> bool:
    # A head that lets go and holds again, over and over, of a stick that creeps up to z = 0 and never arrives.
    still = abs(motion.z) < _NOTHING and abs(motion.v) < _NOTHING and law.k_hand * law.z_ss == 0.0
    return (
        still
        and composition.most_remaining_speed(law, motion) == 0.0
        and not composition.can_add_energy(law, motion)
    )


@njit()
def advance(
    law: Law, motion: Motion, horizon: float, method: int | None, longest_s: float
) -> tuple[int, float]:
    """Move to the next event or by `horizon` seconds, in segments of at most `longest_s`: (event, seconds moved)."""
    moved = 0.0
    at_once = 0
    while True:
        due = composition.due_in(law, motion, motion.contact_phase != ABOVE)
        seg = begin(law, motion, method)
        energy.keep(motion, seg)
        left = horizon - moved
        span = min(left, due, longest_s)
        event, end = first_event(motion, seg, span)
        end = energy.land(motion, seg, event, end, span)
        move(law, motion, seg, end.t, composition.fades(law, end.t), end.z, end.v)
        if motion.energy_w2 > 0.0:
            motion.energy_pull = seg.g + pulses_at_start(composition.pulses(law, motion))
        moved += end.t
        if event == HORIZON:
            if span == left:
                if motion.contact_phase != ABOVE and never_releases(law, motion):
                    motion.outcome = CAPTURED
                return HORIZON, horizon
            renew(law, motion)
            continue
        _land(motion, event)
        apply(law, motion, event)
        if event not in (SEPARATION, RECONTACT, DESCENT):
            return event, moved
        at_once = at_once + 1 if end.t < _INSTANT_S else 0
        if (
            at_once > _MAX_AT_ONCE
        ):  # rounding: a push of 0 that does not change takes hold and lets go for ever
            motion.outcome = CAPTURED
            return HORIZON, horizon
        if _died_away(law, motion):
            motion.outcome = CAPTURED
            return HORIZON, horizon
