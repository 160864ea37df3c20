"""Position of the simulated hand's strikes: on a circle, so that every strike sounds a little different.

Tick thread: no allocation, no locks, no Python, no exceptions.
"""

import math

from haptic_server.records import Plan, TickState
from realtime.kernels.jit import njit


@njit()
def advance_orbit(player: TickState, plan: Plan, span_s: float) -> None:
    """Go on by `span_s`; player.x and player.y are in radii."""
    player.phase += 2.0 * math.pi * span_s / plan.orbit_period_s
    if player.phase > math.pi:
        player.phase -= 2.0 * math.pi
    player.x = plan.orbit_radius * math.cos(player.phase)
    player.y = plan.orbit_radius * math.sin(player.phase)
