"""The method `exact`: closed-form motion between events, events found as roots. There is no time step.

Every effect that ships is linear between its events, so `exact` covers them all. Kernels: tick thread or any other; no
allocation, no exceptions.
"""

import math

from drumstick.stick.motion.advancing import advance as advance_by
from drumstick.stick.motion.events import ABOVE, APEX, CONTACT, ENTRY, HORIZON, RELEASE, SEPARATED, TURN
from drumstick.stick.motion.transitions import CAPTURED, LEFT, MOVING
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit

__all__ = [
    "ABOVE",
    "APEX",
    "CAPTURED",
    "CONTACT",
    "ENTRY",
    "HORIZON",
    "LEFT",
    "MOVING",
    "RELEASE",
    "SEPARATED",
    "TURN",
    "advance",
]


@njit()
def advance(law: Law, motion: Motion, horizon: float) -> tuple[int, float]:
    """Move to the next event or by `horizon` seconds; returns (event, seconds moved).

    ENTRY: the stick meets the head at z = 0 with motion.v_in < 0. TURN: a deepest point. RELEASE: motion.v_out,
    peak_N, impulse_N_s, contact_s, z_min are final. APEX: highest point. HORIZON: none of these within
    `horizon`.
    """
    return advance_by(law, motion, horizon, None, math.inf)
