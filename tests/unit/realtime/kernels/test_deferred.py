"""Kernels declared before numba is loaded: they wait for the first call, and are then what they always were."""

from pathlib import Path

import pytest

from haptic_server.gateway.options import GatewayOptions
from haptic_server.servo.options import ServoOptions
from kernel_program import answer_of
from realtime.service_options import ServiceOptions, command
from sound_server.options import SoundOptions

_NOWHERE = Path("/nowhere/at/all")

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


# What `python -m` starts, up to its own end, which tells; nothing is to be played, so it ends at once, with words.
_SERVICE = """
import gc
import json
import logging
import runpy
import sys

from realtime import log
from realtime.kernels import jit

service, options = sys.argv[1].split(maxsplit=1)
sys.argv = [service, options]
logging.disable()

def tell(status):
    print(json.dumps([status, [repr(each) for each in gc.get_objects() if type(each) is jit._Deferred]]))

log.end_process = tell
runpy.run_module(service, run_name="__main__", alter_sys=True)
"""


@pytest.mark.parametrize(
    ("service", "options", "status"),
    [
        ("haptic_server.servo", ServoOptions(run_dir=_NOWHERE), 3),
        ("haptic_server.gateway", GatewayOptions(run_dir=_NOWHERE, state_dir=_NOWHERE), 1),
        ("sound_server", SoundOptions(audio=f"wav:{_NOWHERE}/heard.wav"), 2),
    ],
)
def test_a_service_has_no_stand_ins(
    tmp_path: Path, service: str, options: ServiceOptions, status: int
) -> None:
    """A call through one costs twice as much, some thousand times a second."""
    started = " ".join(command(service, options)[2:])
    assert answer_of(_SERVICE, tmp_path, started) == [status, []]
