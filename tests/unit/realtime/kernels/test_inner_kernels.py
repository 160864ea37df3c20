"""A kernel that only kernels call has no wrapper for Python, here and in the store, until Python calls it."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernel_program import answer_of
from realtime.kernels import store
from realtime.kernels.inner_kernels import is_wrapped
from realtime.kernels.jit import njit


def test_it_is_wrapped_when_python_calls_it_and_not_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "ROOT", None)  # an earlier run's would be found, with its wrapper

    @njit()
    def doubled(values):
        return 2.0 * values[0]

    @njit()
    def outer(values):
        return doubled(values) + 1.0

    kernel: Any = doubled
    assert outer(np.array([4.0])) == 9.0
    (exclusive_lock,) = kernel.overloads.values()
    assert not is_wrapped(exclusive_lock)
    assert doubled(np.array([5.0])) == 10.0
    (called,) = kernel.overloads.values()
    assert is_wrapped(called)
    assert outer(np.array([6.0])) == 13.0
    assert doubled(np.array([7], np.int64)) == 14.0, "other types get their own"
    assert len(kernel.overloads) == 2


def test_a_kernel_that_python_called_first_is_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "ROOT", None)

    @njit()
    def doubled(value):
        return 2.0 * value

    @njit()
    def outer(value):
        return doubled(value) + 1.0

    kernel: Any = doubled
    assert doubled(4.0) == 8.0
    (before,) = kernel.overloads.values()
    assert outer(4.0) == 9.0
    assert list(kernel.overloads.values()) == [before]


# beta_eq3 is called by first_beta here; what Python calls is the first word.
_PROGRAM = """
import json, sys, warnings
warnings.simplefilter("always")
from drumstick.stick import contact
from realtime.kernels.jit import njit

@njit()
def through(m, k, r):
    return contact.beta_eq3(m, k, r)

called = {"outer": through, "inner": contact.beta_eq3}[sys.argv[1]]
value = called(0.015, 5000.0, 1.3)
print(json.dumps([value, sum(contact.beta_eq3.stats.cache_hits.values())]))
"""


def _run(folder: Path, which: str) -> tuple[float, int]:
    value, hits = answer_of(_PROGRAM, folder, which)
    return value, hits


@pytest.mark.long
def test_what_is_stored_without_a_wrapper_is_none_for_python(tmp_path: Path) -> None:
    value, hits = _run(tmp_path, "outer")
    assert hits == 0
    assert _run(tmp_path, "inner") == (value, 0), "compiled with a wrapper, not called at address 0"
    assert _run(tmp_path, "inner") == (value, 1), "and that one is stored"
