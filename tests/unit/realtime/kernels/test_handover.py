"""A tuple of arrays left by address: taken up whole by a C callback, without references, without allocation."""

import ctypes
import gc
import sys
import weakref
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from numba.core.caching import NullCache
from numba.core.errors import TypingError

from realtime.kernels import handover
from realtime.kernels.handover import ForeignHandle, load_from_address
from realtime.kernels.jit import allocations, cfunction, njit

RECORD: np.dtype[Any] = np.dtype([("a", "f8"), ("b", "i8"), ("path", "f8", (4,))], align=True)


@pytest.fixture(autouse=True)
def kernels_of_this_module_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Code compiled for the tuples below stays out of the cache: no other process could load their classes."""
    monkeypatch.setattr(handover._put, "_cache", NullCache())


class Inner(NamedTuple):
    counts: npt.NDArray[np.int64]
    nothing: Any


class Outer(NamedTuple):
    records: npt.NDArray[np.void]
    inner: Inner
    grid: npt.NDArray[np.float32]
    number: int


def outer() -> Outer:
    grid = np.arange(6, dtype=np.float32).reshape(2, 3)
    return Outer(np.zeros(2, RECORD), Inner(np.arange(4), None), grid, 7)


@njit()
def _work(value: Outer) -> int:
    value.records[1].a += 2.5
    value.records[1].path[3] = value.grid[1, 2]
    value.inner.counts[0] += value.number
    return int(value.inner.counts[0]) + value.grid.shape[0]


def callback_for(kind: Any) -> Any:
    @cfunction("int64(voidptr)", cache=False)
    def callback(argument: Any) -> int:
        return _work(load_from_address(argument, kind))

    return callback


def test_a_callback_works_on_the_very_arrays() -> None:
    value = outer()
    handed = ForeignHandle(value)
    callback = callback_for(handed.kind)
    call = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)(callback.address)
    before = allocations()
    answers = [call(handed.address) for _ in range(1000)]
    assert allocations() == before
    assert answers == [7 * n + 2 for n in range(1, 1001)]
    assert value.records["a"].tolist() == [0.0, 2500.0]
    assert value.records["path"][1].tolist() == [0.0, 0.0, 0.0, 5.0]


def test_it_keeps_the_arrays_alive_and_lets_them_go() -> None:
    value = outer()
    watched = weakref.ref(value.records)
    before = sys.getrefcount(value.records)
    handed = ForeignHandle(value)
    call = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)
    callback = callback_for(handed.kind)
    for _ in range(100):
        call(callback.address)(handed.address)
    after = sys.getrefcount(value.records)
    assert after == before
    del value
    gc.collect()
    assert watched() is not None
    del handed, callback
    gc.collect()
    assert watched() is None


def test_what_owns_memory_of_another_kind_is_refused() -> None:
    with pytest.raises(TypingError):
        ForeignHandle((np.zeros(2), "text"))
