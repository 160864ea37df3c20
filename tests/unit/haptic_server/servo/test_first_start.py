"""Kernels that a first start compiles for the default scene. What Python calls is optimised whole, with all that it
calls, and takes as long as dozens of others: none may come to them by mistake, nor be compiled for a second kind of
argument."""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from kernel_program import answer_of

# sys.argv[1]: whose kernels. Prints those that Python calls, once for each kind of argument, and all that was compiled.
_PROGRAM = """
import gc, json, sys
import numba.core.event as event
from numba.core.dispatcher import Dispatcher

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from realtime.kernels.inner_kernels import is_wrapped

def name(dispatcher):
    return f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"

scene = parse(shipped_text("roll"), "roll")
with event.install_recorder("numba:compile") as recorder:
    if sys.argv[1] == "servo":
        from drumstick.safety import envelope
        from haptic_server import block
        from haptic_server.servo.device.simulated import Simulated
        from haptic_server.servo.force import memory
        device = Simulated(scene)
        device.warm_up(memory.prepare(scene, block.in_memory(law_of(scene))))
    else:
        from haptic_server.gateway.link import warm_up
        warm_up(law_of(scene))
called = [
    name(each) for each in gc.get_objects() if isinstance(each, Dispatcher)
    for made in each.overloads.values() if is_wrapped(made)
]
compiled = [name(found.data["dispatcher"]) for _, found in recorder.buffer if found.is_start]
print(json.dumps({"called": called, "compiled": compiled}))
"""
_CALLED = {
    "servo": {
        "drumstick.safety.envelope.judge": 1,
        "haptic_server.servo.force.guard.rebound_bounds": 1,
        "haptic_server.servo.loop.run_paced": 1,
        "realtime.atomics.peek": 1,
        "realtime.atomics.poke": 1,
    },
    "gateway": {
        "drumstick.stick.contact_ahead.isolated": 1,
        "haptic_server.gateway.event_wait.await_events": 1,
        "realtime.atomics.add_to": 1,
        "realtime.atomics.peek": 1,
        "realtime.atomics.poke": 1,
        "realtime.ring.drain": 1,
        "realtime.triple_buffer.offer": 1,
        "realtime.triple_buffer.recover": 1,
        "realtime.triple_buffer.take": 1,
    },
}
_MOST = {"servo": 236, "gateway": 45}


def _found(program: Path, process: str) -> dict[str, list[str]]:
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(sys.path))
    done = subprocess.run(
        [sys.executable, program, process], capture_output=True, text=True, check=True, env=environment
    )
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("process", _CALLED)
def test_python_calls_these_kernels_of_one_kind_each(process: str, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(_PROGRAM, encoding="utf-8")
    found = _found(program, process)
    if found["compiled"]:
        # Then kernels that only kernels call came from the store, as others left them there: once more, with none.
        found = _found(program, process)
    assert Counter(found["called"]) == _CALLED[process]


@pytest.mark.long
@pytest.mark.parametrize("process", _CALLED)
def test_a_first_start_compiles_no_more_kernels_than_it_did(process: str, tmp_path: Path) -> None:
    found: dict[str, Any] = answer_of(_PROGRAM, tmp_path, process)
    assert len(found["compiled"]) <= _MOST[process], Counter(found["compiled"]).most_common(5)
    # The exact stick is no sampled arm.
    assert not [name for name in found["compiled"] if name.startswith("drumstick.safety.sampled_contact")]
