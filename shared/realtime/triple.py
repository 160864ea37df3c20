"""A wait-free triple buffer: the newest whole record from one writer to one reader; nothing torn, nobody waits.

Three slots: one belongs to the writer, one to the reader, one lies between. `cells[0]` names the slot between, with
FRESH added while the reader has not taken it; `cells[8]` is the writer's slot, `cells[16]` the reader's.
"""

from realtime.atomics import exchange, load_acquire, store_release
from realtime.jit import njit

BETWEEN, WRITER, READER = 0, 8, 16
CELLS = 24
FRESH = 4


@njit()
def clear(cells, slots, record):
    """Make all three slots equal to `record`; only before the other side starts."""
    for i in range(3):
        slots[i] = record
    store_release(cells, WRITER, 0)
    store_release(cells, READER, 2)
    store_release(cells, BETWEEN, 1)


@njit()
def publish(cells, slots, record):
    """Offer `record` as the newest (one writer)."""
    mine = cells[WRITER]
    slots[mine] = record
    store_release(cells, WRITER, exchange(cells, BETWEEN, mine + FRESH) % FRESH)


@njit()
def take(cells, slots):
    """The index of the slot to read (one reader): the newest record if there is one, else the one held before."""
    if load_acquire(cells, BETWEEN) >= FRESH:
        store_release(cells, READER, exchange(cells, BETWEEN, cells[READER]) % FRESH)
    return cells[READER]


@njit()
def has_fresh(cells):
    """Whether `take` would return a record that the reader has not seen."""
    return load_acquire(cells, BETWEEN) >= FRESH


@njit()
def read_into(cells, slots, out):
    """Copy the newest record into out[0] (one reader); True when it is one not seen before."""
    fresh = has_fresh(cells)
    out[0] = slots[take(cells, slots)]
    return fresh
