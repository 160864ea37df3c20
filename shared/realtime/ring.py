"""A single-producer, single-consumer ring of records between two threads or processes.

`cells[0]` counts records written, `cells[8]` records read, `cells[16]` records dropped because the ring was
full (each on its own cache line). The counters are int64 and only grow: at 1 kHz they last 290 million years.
"""

import numpy as np
import numpy.typing as npt

from realtime.atomics import load_acquire, store_release
from realtime.kernels.jit import njit
from realtime.records import Record, Records

WRITTEN, READ, DROPPED = 0, 8, 16
CELLS = 24


@njit()
def push(cells: npt.NDArray[np.int64], slots: Records, record: Record) -> bool:
    """Append `record` (one producer, any thread); wait-free. False, and counted, when the ring is full."""
    written = cells[WRITTEN]
    if written - load_acquire(cells, READ) >= slots.shape[0]:
        store_release(cells, DROPPED, cells[DROPPED] + 1)
        return False
    slots[written % slots.shape[0]] = record
    store_release(cells, WRITTEN, written + 1)
    return True


@njit()
def drain(cells: npt.NDArray[np.int64], slots: Records, out: Records) -> int:
    """Move up to len(out) records into `out`, oldest first; returns how many. One consumer; wait-free."""
    read = cells[READ]
    count = min(load_acquire(cells, WRITTEN) - read, out.shape[0])
    for i in range(count):
        out[i] = slots[(read + i) % slots.shape[0]]
    store_release(cells, READ, read + count)
    return count


def new_cells() -> npt.NDArray[np.int64]:
    """Counters of an empty ring, shape (24,)."""
    return np.zeros(CELLS, np.int64)
