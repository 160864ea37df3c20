"""Kernels declared before numba is loaded: they wait for the first call, and are then what they always were."""

from pathlib import Path

import pytest

from kernel_program import answer_of

# `early`: declared without numba, called by two threads at once. `late`: the same text with numba loaded before.
_PROGRAM = """
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

if sys.argv[1] == "late":
    import numba
import numpy as np

from realtime import clock
from realtime.atomics import fence, load_acquire, peek, store_release
from realtime.kernels.folding import added, folded
from realtime.kernels.jit import njit, only_with, overload, record_has

@folded({"half": SimpleNamespace(share=njit()(lambda law: 0.5 * law.half))}, added)
def share(law):
    return 0.0

@only_with("half", otherwise=-1.0)
def whole(law):
    return law.half

def has_half(law):
    raise TypeError("compiled code only")

@overload(has_half)
def _has_half(law):
    found = record_has(law, "half")
    return lambda law: found

@njit()
def inner(law):
    return whole(law) + share(law)

@njit()
def outer(cells, law, buffer):
    fence()
    store_release(cells, 0, 7)
    return inner(law), has_half(law), load_acquire(cells, 0), clock.now_ns(buffer) > 0

kernels = [njit()(lambda n, k=k: n + k) for k in range(2000)]  # more than Python calls within one another
before = "numba" in sys.modules

def played(field):
    law = np.ones(1, [(field, "f8")])
    return outer(np.zeros(1, np.int64), law[0], np.zeros(2, np.int64))

with ThreadPoolExecutor(2) as threads:
    answers = list(threads.map(played, ("half", "other")))

@njit()
def afterwards(n):
    return inner(n) + 1.0

law = np.ones(1, [("half", "f8")])
print(json.dumps([
    before, answers, afterwards(law[0]), peek(np.array([4]), 0), kernels[-1](1),
    outer.__name__, len(outer.overloads), outer.py_func.__name__,
]))
"""  # fmt: skip
PLAYED = [[1.5, True, 7, True], [-1.0, False, 7, True]]


def test_they_wait_for_the_first_call_and_are_then_as_others(tmp_path: Path) -> None:
    early, late = (answer_of(_PROGRAM, tmp_path, when) for when in ("early", "late"))
    assert early == [False, PLAYED, 2.5, 4, 2000, "outer", 2, "outer"]
    assert late == [True, *early[1:]]


_SERVICE = """
import gc
import importlib
import json
import sys

service, process = sys.argv[1].split(",")
importlib.import_module(service)  # as `python -m` does first
importlib.import_module(service + ".options")
from realtime.kernels import jit

jit.leave_out_blas()
importlib.import_module(process)
print(json.dumps([repr(each) for each in gc.get_objects() if type(each) is jit._Deferred]))
"""


@pytest.mark.parametrize(
    "names",
    [
        "haptic_server.servo,haptic_server.servo.process",
        "haptic_server.gateway,haptic_server.gateway.process",
        "sound_server,sound_server.server",
    ],
)
def test_a_service_has_no_stand_ins(tmp_path: Path, names: str) -> None:
    """A call through one costs twice as much, some thousand times a second."""
    assert answer_of(_SERVICE, tmp_path, names) == []
