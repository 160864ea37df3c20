"""A wait-free triple buffer: the newest whole record from one writer to one reader, never torn.

Three slots: one belongs to the writer, one to the reader, one lies between. `cells[0]` names the slot
between, with FRESH added while the reader has not taken it; `cells[8]` is the writer's slot, `cells[16]` the
reader's.
"""

import numpy as np
import numpy.typing as npt

from realtime.atomics import exchange, load_acquire, peek, poke, store_release
from realtime.kernels.jit import njit
from realtime.records import Record, Records

BETWEEN, WRITER, READER = 0, 8, 16
CELLS = 24
FRESH = 4


def clear(cells: npt.NDArray[np.int64], slots: Records, record: Record) -> None:
    """Make all three slots equal to `record`; only before the other side starts. From Python."""
    slots[:3] = record
    for cell, slot in ((WRITER, 0), (READER, 2), (BETWEEN, 1)):
        poke(cells, cell, slot)


@njit()
def publish(cells: npt.NDArray[np.int64], slots: Records, record: Record) -> None:
    """Offer `record` as the newest (one writer)."""
    slots[cells[WRITER]] = record
    offer(cells)


@njit()
def offer(cells: npt.NDArray[np.int64]) -> None:
    """Offer what the writer wrote into slots[cells[WRITER]] in place; that slot is then another (one writer)."""
    store_release(cells, WRITER, exchange(cells, BETWEEN, cells[WRITER] + FRESH) % FRESH)


@njit()
def take(cells: npt.NDArray[np.int64]) -> int:
    """The index of the slot to read (one reader): the newest record, else the one held before."""
    if load_acquire(cells, BETWEEN) >= FRESH:
        store_release(cells, READER, exchange(cells, BETWEEN, cells[READER]) % FRESH)
    return cells[READER]


@njit()
def has_fresh(cells: npt.NDArray[np.int64]) -> bool:
    """True when `take` would return a record that the reader has not seen."""
    return load_acquire(cells, BETWEEN) >= FRESH


def read_into(cells: npt.NDArray[np.int64], slots: Records, out: Records) -> bool:
    """Copy the newest record into out[0] (one reader); True when it is one not seen before. From Python."""
    before = peek(cells, READER)
    slot = take(cells)
    out[0] = slots[slot]
    return slot != before  # not by a look before `take`: what came between would be taken, and nobody told


def publish_record(cells: npt.NDArray[np.int64], slots: Records, record: Record) -> None:
    """Offer `record` as the newest (one writer). From Python: not compiled for each kind of record, as `publish` is."""
    slots[cells[WRITER]] = record
    offer(cells)


@njit()
def recover(cells: npt.NDArray[np.int64], own: int, other: int) -> bool:
    """Give back its slot to a side (`own` is WRITER or READER) whose process died and starts again.

    It may have died between the exchange and noting its new slot; the slot that is neither between nor the
    other side's is then the only one free. False when the other side is in the middle of an exchange: call
    again.
    """
    between = load_acquire(cells, BETWEEN)
    others = load_acquire(cells, other)
    if between % FRESH == others or load_acquire(cells, BETWEEN) != between:
        return False
    store_release(cells, own, 3 - between % FRESH - others)
    return True
