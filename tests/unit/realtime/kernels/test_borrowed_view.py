"""A tuple of arrays passed on by its address: the same arrays, no references counted, no allocation."""

import sys
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest
from numba.core.errors import TypingError

from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import allocations, is_none, njit, overload

RECORD: np.dtype[Any] = np.dtype([("a", "f8"), ("path", "f8", (4,))], align=True)


class Inner(NamedTuple):
    counts: npt.NDArray[np.int64]
    nothing: Any


class Outer(NamedTuple):
    records: npt.NDArray[np.void]
    inner: Inner
    grid: npt.NDArray[np.float64]
    plant: Any


def outer(plant: Any = None) -> Outer:
    return Outer(np.zeros(2, RECORD), Inner(np.arange(4), None), np.arange(6.0).reshape(2, 3), plant)


@njit()
def _work(value: Outer) -> float:
    block = value.inner
    block.counts[1] += 5
    value.records[1].a += 2.5
    value.records[1].path[3] = value.grid[1, 2]
    return value.records[1].a + value.grid.shape[0]


@njit()
def _work_often(value: Outer, times: int) -> float:
    value = borrowed_view(value)
    total = 0.0
    for _ in range(times):
        total += _work(borrowed_view(value))  # what is lent already stays as it is
    return total


def test_it_works_on_the_very_arrays() -> None:
    value = outer()
    assert _work_often(value, 3) == 2.5 + 5.0 + 7.5 + 3 * 2
    assert value.records["a"].tolist() == [0.0, 7.5]
    assert value.records["path"][1].tolist() == [0.0, 0.0, 0.0, 5.0]
    assert value.inner.counts.tolist() == [0, 16, 2, 3]


def test_it_counts_no_references_and_allocates_nothing() -> None:
    value = outer()
    _work_often(value, 1)
    references = [sys.getrefcount(array) for array in (value.records, value.inner.counts, value.grid)]
    counts: list[int] = []
    for times in (1, 100_000):  # a call from Python wraps the arrays, whatever it does with them
        before = allocations()
        _work_often(value, times)
        counts.append(allocations() - before)
    assert counts[0] == counts[1]
    assert [sys.getrefcount(a) for a in (value.records, value.inner.counts, value.grid)] == references


def _kind(value: Outer) -> int:
    raise TypeError("compiled code only")


@overload(_kind)
def _kind_by_type(value: Any) -> Any:
    nothing = is_none(value, "plant")
    return lambda value: 1 if nothing else 2


@njit()
def _kind_of_lent(value: Outer) -> int:
    return _kind(borrowed_view(value))


def test_types_choose_the_code_as_they_do_for_the_tuple() -> None:
    assert _kind_of_lent(outer()) == 1
    assert _kind_of_lent(outer(np.zeros(1, RECORD))) == 2


@njit()
def _wrong_name(value: Outer) -> float:
    return borrowed_view(value).grids[0, 0]


@njit()
def _no_named_tuple(value: tuple[npt.NDArray[np.float64]]) -> float:
    return borrowed_view(value)[0][0]


def test_a_wrong_name_and_what_is_no_named_tuple_are_refused_when_compiled() -> None:
    with pytest.raises(TypingError, match="grids"):
        _wrong_name(outer())
    with pytest.raises(TypingError):
        _no_named_tuple((np.zeros(1),))
