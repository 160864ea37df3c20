"""The ring between two threads that both run compiled loops without the GIL: nothing lost, torn or out of order."""

import threading

import numpy as np
import numpy.typing as npt
import pytest

from realtime import ring
from realtime.atomics import load_acquire, peek, store_release
from realtime.kernels.jit import njit
from realtime.records import Records

RECORDS = 1_000_000
# Wider than any single store, so that a half-written record would show: every field is derived from `n`.
RECORD = np.dtype([("n", "i8"), ("twice", "i8"), ("half", "f8"), ("minus", "i8")], align=True)
STARTED, DONE = 0, 8


@njit()
def _produce(
    cells: npt.NDArray[np.int64],
    slots: Records,
    scratch: Records,
    count: int,
    wait: bool,
    gate: npt.NDArray[np.int64],
) -> int:
    # Push count records; with `wait` try again while the ring is full. Returns how many went in.
    while load_acquire(gate, STARTED) == 0:
        pass
    pushed = 0
    record = scratch[0]
    for n in range(count):
        record.n = n
        record.twice = 2 * n
        record.half = 0.5 * n
        record.minus = -n
        done = ring.push(cells, slots, record)
        while wait and not done:
            done = ring.push(cells, slots, record)
        pushed += done
    store_release(gate, DONE, 1)
    return pushed


@njit()
def _consume(
    cells: npt.NDArray[np.int64],
    slots: Records,
    out: Records,
    gate: npt.NDArray[np.int64],
    seen: npt.NDArray[np.int64],
) -> None:
    # seen: received, torn, out of order, gaps
    store_release(gate, STARTED, 1)
    last = -1
    while True:
        done = load_acquire(gate, DONE)
        count = ring.drain(cells, slots, out)
        for i in range(count):
            record = out[i]
            if record.twice != 2 * record.n or record.half != 0.5 * record.n or record.minus != -record.n:
                seen[1] += 1
            if record.n <= last:
                seen[2] += 1
            seen[3] += record.n - last - 1
            last = record.n
        seen[0] += count
        if done == 1 and count == 0:
            return


def _run(wait: bool, slots: int) -> tuple[int, list[int], int]:
    cells, gate = ring.new_cells(), np.zeros(16, np.int64)
    memory, scratch, out = np.zeros(slots, RECORD), np.zeros(1, RECORD), np.zeros(64, RECORD)
    seen = np.zeros(4, np.int64)
    pushed: list[int] = []
    producer = threading.Thread(
        target=lambda: pushed.append(_produce(cells, memory, scratch, RECORDS, wait, gate)), daemon=True
    )
    producer.start()
    _consume(cells, memory, out, gate, seen)
    producer.join()
    return pushed[0], [int(x) for x in seen], peek(cells, ring.DROPPED)


def test_a_producer_that_waits_loses_nothing() -> None:
    pushed, (received, torn, disordered, gaps), _ = _run(wait=True, slots=1024)
    assert (pushed, received, torn, disordered, gaps) == (RECORDS, RECORDS, 0, 0, 0)


def test_a_producer_that_does_not_wait_counts_what_it_drops() -> None:
    pushed, (received, torn, disordered, gaps), dropped = _run(wait=False, slots=16)
    assert (torn, disordered) == (0, 0)
    assert pushed == received
    assert received + dropped == RECORDS
    assert gaps <= dropped  # the last ones dropped leave no gap behind


@pytest.mark.parametrize("slots", [1, 3, 8])
def test_a_full_ring_refuses_and_goes_on_after_a_drain(slots: int) -> None:
    cells, memory = ring.new_cells(), np.zeros(slots, np.dtype([("n", "i8")]))
    record, out = np.zeros(1, memory.dtype), np.zeros(slots + 2, memory.dtype)
    for turn in range(5):
        for n in range(slots):
            record["n"] = 100 * turn + n
            assert ring.push(cells, memory, record[0])
        assert not ring.push(cells, memory, record[0])
        assert ring.drain(cells, memory, out) == slots
        assert out["n"][:slots].tolist() == [100 * turn + n for n in range(slots)]
        assert ring.drain(cells, memory, out) == 0
    assert peek(cells, ring.DROPPED) == 5


def test_drain_takes_no_more_than_there_is_room_for() -> None:
    cells, memory = ring.new_cells(), np.zeros(8, np.dtype([("n", "i8")]))
    record, out = np.zeros(1, memory.dtype), np.zeros(3, memory.dtype)
    for n in range(7):
        record["n"] = n
        ring.push(cells, memory, record[0])
    taken: list[int] = []
    while count := ring.drain(cells, memory, out):
        taken += out["n"][:count].tolist()
    assert taken == list(range(7))
