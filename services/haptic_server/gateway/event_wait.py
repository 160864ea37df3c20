"""Waiting for the servo's events: looking just after each tick while a contact may come, asleep while none can.

The servo makes no system call to wake anybody, so the gateway has to look. It reads the stick's height and speed, which
the servo publishes at each tick, and sleeps over the ticks in which the stick cannot have come down to the head. The
relay's thread, without the GIL.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from haptic_server.block import Slots
from realtime import ring, triple_buffer
from realtime.atomics import exchange, load_acquire
from realtime.clock import now_ns, sleep_until
from realtime.kernels.jit import njit

Cells = npt.NDArray[np.int64]

MAX_SLEEP_NS = 2_000_000  # a strike that was not foreseen is seen so late at most
CLOSE_NS = 50_000  # between two looks while a tick is awaited
AFTER_TICK_NS = 30_000  # a tick on time is over by then
# Towards the head. A hand spring pulls with some tens of m/s^2, a hand throws with hundreds.
MAX_ACCELERATION_M_PER_S2 = 1000.0
_MAX_SPEED_M_PER_S = 1e3
_STILL_M_PER_S = 1e-3


class Awaited(NamedTuple):
    """Views that the wait looks at. Counters of the events' ring and of the streamed force's, cells of the set that the
    servo uses, a cell that wakes, and the servo's status.
    """

    ring_cells: Cells
    force_cells: Cells
    live_cells: Cells
    wake_cells: Cells
    status_cells: Cells
    status: Slots


@njit()
def flight_ns(z_m: float, v_m_per_s: float) -> int:
    """Time for which the stick stays above the head at least, ns: at most MAX_ACCELERATION pulls it down."""
    if not (z_m > 0.0 and abs(v_m_per_s) < _MAX_SPEED_M_PER_S):
        return 0
    root = math.sqrt(v_m_per_s * v_m_per_s + 2.0 * MAX_ACCELERATION_M_PER_S2 * z_m)
    return int(1e9 * (v_m_per_s + root) / MAX_ACCELERATION_M_PER_S2)


@njit()
def is_still(z_m: float, v_m_per_s: float) -> bool:
    """True when the stick is in the head and does not move, as it also is for a moment when it turns."""
    return z_m <= 0.0 and abs(v_m_per_s) <= _STILL_M_PER_S


@njit()
def quiet_ns(z_m: float, v_m_per_s: float, still_ns: int, period_ns: int) -> int:
    """Time for which no event can come after a tick, ns. still_ns: from the last tick at which it moved to this one."""
    if 2 * still_ns > 3 * period_ns:  # at two ticks: it does not only turn
        return MAX_SLEEP_NS
    return flight_ns(z_m, v_m_per_s)


@njit()
def next_look_ns(now: int, tick_ns: int, quiet_ns: int, period_ns: int) -> int:
    """Time of the next look, monotonic ns. The last tick was at tick_ns; no event can come for quiet_ns after it.

    That is just after the first tick that may have seen one, and soon where that tick is late. A servo that has stood
    still for longer than MAX_SLEEP_NS is looked at as seldom as one at rest.
    """
    ticks = max(1, -(-quiet_ns // period_ns))
    due = tick_ns + ticks * period_ns + AFTER_TICK_NS
    if now < due:
        return min(due, now + MAX_SLEEP_NS)
    return now + (CLOSE_NS if now - due < MAX_SLEEP_NS else MAX_SLEEP_NS)


@njit()
def _something_waits(awaited: Awaited) -> bool:
    return (
        load_acquire(awaited.ring_cells, ring.WRITTEN) != awaited.ring_cells[ring.READ]
        or load_acquire(awaited.force_cells, ring.WRITTEN) != awaited.force_cells[ring.READ]
        or triple_buffer.has_fresh(awaited.live_cells)
        or (load_acquire(awaited.wake_cells, 0) != 0 and exchange(awaited.wake_cells, 0, 0) != 0)
    )


@njit()
def await_events(awaited: Awaited, moved_ns: Cells, timespec: Cells, period_ns: int, until_ns: int) -> int:
    """Sleep until something waits for the gateway, or until until_ns (monotonic); returns how often it looked.

    What waits: events, streamed force, a set that the servo has taken, or whoever put something into wake_cells[0].
    period_ns: of the servo's ticks. The caller's own: moved_ns, shape (1,), the last tick at which the stick moved, 0
    before the first call; `timespec`, shape (2,).
    """
    looks = 0
    now = now_ns(timespec)
    status_cells, status = awaited.status_cells, awaited.status
    if moved_ns[0] == 0:
        moved_ns[0] = status[triple_buffer.take(status_cells)].t_ns
    while not _something_waits(awaited) and now < until_ns:
        seen = status[triple_buffer.take(status_cells)]
        if not is_still(seen.z_m, seen.v_m_per_s):
            moved_ns[0] = seen.t_ns
        quiet = quiet_ns(seen.z_m, seen.v_m_per_s, seen.t_ns - moved_ns[0], period_ns)
        sleep_until(timespec, min(next_look_ns(now, seen.t_ns, quiet, period_ns), until_ns))
        now = now_ns(timespec)
        looks += 1
    return looks
