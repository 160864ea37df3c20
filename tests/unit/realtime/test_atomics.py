"""Atomic cells: a compiled loop sees another thread's store, and concurrent additions all count."""

import threading

import numpy as np
import numpy.typing as npt
import pytest
from numba.core.errors import TypingError

from realtime.atomics import add, exchange, load_acquire, peek, poke
from realtime.kernels.jit import allocations, njit

ADDITIONS = 2_000_000


@njit()
def _wait_for(cells: npt.NDArray[np.int64], value: int) -> int:
    turns = 0
    while load_acquire(cells, 0) != value:
        turns += 1
    return turns


@njit()
def _add_many(cells: npt.NDArray[np.int64], count: int) -> None:
    for _ in range(count):
        add(cells, 3, 1)


@njit()
def _swap(cells: npt.NDArray[np.int64], value: int) -> int:
    return exchange(cells, 1, value)


def test_a_compiled_poll_sees_a_store_from_python() -> None:
    cells = np.zeros(4, np.int64)
    waiting = threading.Thread(target=_wait_for, args=(cells, 7), daemon=True)
    waiting.start()
    poke(cells, 0, 7)
    waiting.join(60.0)
    assert not waiting.is_alive()


def test_no_addition_is_lost() -> None:
    cells = np.zeros(4, np.int64)
    threads = [threading.Thread(target=_add_many, args=(cells, ADDITIONS)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert peek(cells, 3) == 2 * ADDITIONS


def test_exchange_gives_back_what_was_there() -> None:
    cells = np.zeros(4, np.int64)
    assert [_swap(cells, value) for value in (5, -2, 9)] == [0, 5, -2]
    assert cells.tolist() == [0, 9, 0, 0]


@pytest.mark.parametrize("cells", [np.zeros(4, np.int32), np.zeros(4), np.zeros((2, 2), np.int64)])
def test_only_flat_int64_cells_compile(cells: npt.NDArray[np.int64]) -> None:
    with pytest.raises(TypingError):
        peek(cells, 0)


def test_cells_allocate_nothing() -> None:
    """The call from Python itself adapts the array once; a thousand additions cost no more than one."""
    cells = np.zeros(4, np.int64)
    _add_many(cells, 1)
    counts = [allocations()]
    for additions in (1, 1000):
        _add_many(cells, additions)
        counts.append(allocations())
    assert counts[2] - counts[1] == counts[1] - counts[0]
