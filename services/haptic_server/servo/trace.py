"""The last thousand ticks, kept so that a fault can be looked at afterwards.

`note` belongs to the tick thread: no allocation, no locks, no Python, no exceptions. It stops while a fault is latched,
so the record ends with the tick that raised it; `ordered` and `as_csv` are for a control thread, then.
"""

import numpy as np
import numpy.typing as npt

from drumstick.stick.records import Motion
from haptic_server.records import NO_FAULT, Reading, TickState
from realtime.kernels.jit import njit
from realtime.records import Record, Records, Rows, dtype_of

TICKS = 1000


class Trace(Record):
    """z_m and v_m_per_s are those that the law used last, so a reading that was refused shows only as told_z_m: the
    device's raw reading, m above the head. It is meaningless for the exact stick, which has no device.
    """

    t_ns: int
    span_s: float
    z_m: float
    v_m_per_s: float
    force_N: float
    place: int  # of the motion, its contact phase; the column is as old as the file
    fault: int
    told_z_m: float
    fresh: int


TRACE = dtype_of(Trace)


@njit()
def note(
    trace: Records,
    motion: Motion,
    tick_state: TickState,
    reading: Reading,
    head_z_m: float,
    now_ns: int,
    span_s: float,
) -> None:
    """Keep this tick; `tick_state.traced` counts the ticks that were kept."""
    if tick_state.fault != NO_FAULT and tick_state.trace_ended != 0:
        return
    row: Trace = trace[tick_state.traced % TICKS]
    row.t_ns = now_ns
    row.span_s = span_s
    row.z_m = motion.z
    row.v_m_per_s = motion.v
    row.force_N = tick_state.force_N
    row.place = motion.contact_phase
    row.fault = tick_state.fault
    row.told_z_m = reading.z_m - head_z_m
    row.fresh = reading.fresh
    tick_state.traced += 1
    tick_state.trace_ended = 1 if tick_state.fault != NO_FAULT else 0


def ordered(trace: Rows[Trace], traced: int) -> npt.NDArray[np.void]:
    """The kept ticks from the oldest to the newest, shape (n,), n <= 1000."""
    rows = np.asarray(trace)
    return rows[:traced].copy() if traced < TICKS else np.roll(rows, -(traced % TICKS))


def as_csv(rows: npt.NDArray[np.void]) -> str:
    """One line a tick under a line of names; SI units as the names say."""
    names = rows.dtype.names or ()
    lines = [",".join(names)]
    lines += [",".join(repr(value) for value in row.tolist()) for row in rows]
    return "\n".join(lines) + "\n"
