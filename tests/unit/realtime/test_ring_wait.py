"""Waiting for a ring: it ends with the first record or at its time, and the GIL is free meanwhile."""

import threading
import time

import numpy as np

from realtime import ring

_RECORD = np.dtype([("n", "i8")])
_FOR_EVER_NS = 10**18


def _wait(cells: np.ndarray, until_ns: int) -> bool:
    return bool(ring.await_written(cells, np.zeros(2, np.int64), 100_000, until_ns))


def test_what_is_there_already_needs_no_waiting() -> None:
    cells, slots = ring.new_cells(), np.zeros(4, _RECORD)
    ring.push(cells, slots, slots[0])
    assert _wait(cells, _FOR_EVER_NS)
    assert ring.drain(cells, slots, np.zeros(4, _RECORD)) == 1
    assert not _wait(cells, 0)


def test_it_ends_at_its_time() -> None:
    cells = ring.new_cells()
    until_ns = time.monotonic_ns() + 5_000_000
    assert not _wait(cells, until_ns)
    assert time.monotonic_ns() >= until_ns


def test_python_goes_on_and_its_record_ends_the_wait() -> None:
    cells, slots = ring.new_cells(), np.zeros(4, _RECORD)
    _wait(cells, 0)  # compiled
    found: list[bool] = []
    waiting = threading.Thread(target=lambda: found.append(_wait(cells, _FOR_EVER_NS)))
    waiting.start()
    assert sum(range(100_000)) > 0
    assert found == []
    ring.push(cells, slots, slots[0])
    waiting.join(30.0)
    assert found == [True]
