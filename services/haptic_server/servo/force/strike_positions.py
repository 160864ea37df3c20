"""Position of the simulated hand's strikes: on a circle, so that every strike sounds a little different.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

import math

from haptic_server.records import Plan, TickState
from realtime.kernels.jit import njit


@njit()
def advance_orbit(tick_state: TickState, plan: Plan, span_s: float) -> None:
    """Go on by `span_s`; tick_state.x and tick_state.y are in radii."""
    tick_state.phase += 2.0 * math.pi * span_s / plan.orbit_period_s
    if tick_state.phase > math.pi:
        tick_state.phase -= 2.0 * math.pi
    tick_state.x = plan.orbit_radius * math.cos(tick_state.phase)
    tick_state.y = plan.orbit_radius * math.sin(tick_state.phase)
