"""Waiting for the servo's events: looking just after each tick while a contact may come, asleep while none can.

The servo makes no system call to wake anybody, so the gateway has to look. It reads the stick's height and speed, which
the servo publishes at each tick, and sleeps over the ticks in which the stick cannot have come down to the head. While
a strike has no release yet, a stick above the head is looked at after each tick: its release may come with any. A stick
that lies still in the head is slept over, so a hand that lifts it is seen up to MAX_SLEEP_NS late; not while force is
streamed, since then each tick has something for the gateway. The relay's thread, without the GIL.
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
    """Time for which the stick stays above the head at least, ns: at most MAX_ACCELERATION pulls it down.

    z_m is as published: of a sampled arm, led by `lead` times its speed. A pull moves the led place by what it adds to
    the speed too, so a strike t from now is foreseen under a pull of at most MAX_ACCELERATION t/(t + 2 lead).
    """
    if not (z_m > 0.0 and abs(v_m_per_s) < _MAX_SPEED_M_PER_S):
        return 0
    root = math.sqrt(v_m_per_s * v_m_per_s + 2.0 * MAX_ACCELERATION_M_PER_S2 * z_m)
    return int(1e9 * (v_m_per_s + root) / MAX_ACCELERATION_M_PER_S2)


@njit()
def is_still(z_m: float, v_m_per_s: float) -> bool:
    """True when the stick is in the head and does not move, as it also is for a moment when it turns."""
    return z_m <= 0.0 and abs(v_m_per_s) <= _STILL_M_PER_S


@njit()
def still_since_ns(since_ns: int, tick_ns: int, z_m: float, v_m_per_s: float) -> int:
    """Tick at which the stick was first seen still without having been seen to move since, 0 where it moves.

    since_ns: the same of the sight before; tick_ns, z_m and v_m_per_s: of this one.
    """
    if not is_still(z_m, v_m_per_s):
        return 0
    return since_ns if since_ns != 0 else tick_ns


@njit()
def quiet_ns(z_m: float, v_m_per_s: float, still_ns: int, is_open: bool) -> int:
    """Time for which no event can come after a tick, ns. still_ns: from the first tick at which it was seen still to
    this one; is_open: a strike has no release yet.
    """
    if still_ns > 0:  # seen at two ticks, one after the other: it does not only turn
        return MAX_SLEEP_NS
    return 0 if is_open else flight_ns(z_m, v_m_per_s)


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
def await_events(
    awaited: Awaited, still_cells: Cells, timespec: Cells, period_ns: int, until_ns: int, is_open: bool
) -> int:
    """Sleep until something waits for the gateway, or until until_ns (monotonic); returns how often it looked.

    What waits: events, streamed force, a set that the servo has taken, or whoever put something into wake_cells[0].
    period_ns: of the servo's ticks; is_open: a strike has no release yet. The caller's own, zero before the first call:
    still_cells, shape (1,), what still_since_ns told last; `timespec`, shape (2,).
    """
    looks = 0
    now = now_ns(timespec)
    status_cells, status = awaited.status_cells, awaited.status
    while not _something_waits(awaited) and now < until_ns:
        seen = status[triple_buffer.take(status_cells)]
        since = still_since_ns(still_cells[0], seen.t_ns, seen.z_m, seen.v_m_per_s)
        still_cells[0] = since
        still = seen.t_ns - since if since != 0 else 0
        quiet = quiet_ns(seen.z_m, seen.v_m_per_s, still, is_open)
        sleep_until(timespec, min(next_look_ns(now, seen.t_ns, quiet, period_ns), until_ns))
        now = now_ns(timespec)
        looks += 1
    return looks
