"""A kernel that only kernels call has no machine code of its own, here and in the store; its callers run it all the
same."""

from pathlib import Path
from typing import Any

import pytest

from kernel_program import answer_of
from realtime.kernels import store
from realtime.kernels.jit import njit

# Three levels, and a third kernel that takes the innermost one from the store; sys.argv[1] says which Python calls.
_PROGRAM = """
import json, sys, warnings
warnings.simplefilter("error")
from realtime.kernels.jit import njit

@njit()
def innermost(a, b):
    return a * b + 0.1

@njit()
def inner(a, b):
    return innermost(a, b) + innermost(b, a + 1.0)

@njit()
def outer(a, b):
    total = 0.0
    for i in range(5):
        total += inner(a + i, b)
    return total

@njit()
def another(a, b):
    return innermost(a, b) - 1.0

kernels = {each.__name__: each for each in (innermost, inner, outer, another)}
value = kernels[sys.argv[1]](2.0, 3.0)
inner_ones = sorted(
    name for name, each in kernels.items() for made in each.overloads.values() if made.library.is_inner
)
hits = {name: sum(each.stats.cache_hits.values()) for name, each in kernels.items()}
print(json.dumps([value, inner_ones, hits]))
"""


def _run(folder: Path, which: str) -> tuple[float, list[str], dict[str, int]]:
    value, inner_ones, hits = answer_of(_PROGRAM, folder, which)
    return value, inner_ones, hits


def _innermost(a: float, b: float) -> float:
    return a * b + 0.1


OUTER = sum(_innermost(2.0 + i, 3.0) + _innermost(3.0, 3.0 + i) for i in range(5))


@pytest.mark.long
def test_the_store_brings_the_whole_and_its_parts_serve_other_callers(tmp_path: Path) -> None:
    value, inner_ones, hits = _run(tmp_path, "outer")
    assert value == pytest.approx(OUTER, rel=1e-15)
    assert inner_ones == ["inner", "innermost"]
    assert set(hits.values()) == {0}
    value, inner_ones, hits = _run(tmp_path, "outer")
    assert (value, inner_ones) == (pytest.approx(OUTER, rel=1e-15), [])
    assert hits == {"outer": 1, "inner": 0, "innermost": 0, "another": 0}
    value, inner_ones, hits = _run(tmp_path, "another")
    assert (value, inner_ones) == (pytest.approx(_innermost(2.0, 3.0) - 1.0), ["innermost"])
    assert hits["innermost"] == 1


@pytest.mark.long
def test_python_may_call_a_stored_part_too(tmp_path: Path) -> None:
    _run(tmp_path, "outer")
    for _ in range(2):  # compiled once more, with machine code and a wrapper; then stored so
        value, inner_ones, _ = _run(tmp_path, "innermost")
        assert (value, inner_ones) == (pytest.approx(_innermost(2.0, 3.0)), [])
    value, _, _ = _run(tmp_path, "outer")
    assert value == pytest.approx(OUTER, rel=1e-15)


def test_only_what_python_calls_has_machine_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "ROOT", None)

    @njit()
    def inner(value):
        return 2.0 * value

    @njit()
    def outer(value):
        return inner(value) + 1.0

    assert outer(4.0) == 9.0
    kernels: list[Any] = [inner, outer]
    (part,), (whole,) = (list(each.overloads.values()) for each in kernels)
    assert (part.library.is_inner, whole.library.is_inner) == (True, False)
    assert part.library.get_pointer_to_function(part.fndesc.llvm_func_name) == 0
    assert whole.library.get_pointer_to_function(whole.fndesc.llvm_cpython_wrapper_name) != 0
    assert inner(5.0) == 10.0
