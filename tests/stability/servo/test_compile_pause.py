"""A scene whose loop is compiled when its first tick is due: it stands still for as long as a compiler takes."""

import time
from typing import Any

import pytest

from drumstick.scenes.scene_text import parse
from drumstick.stick.law import law_of
from haptic_server import block
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from haptic_server.servo.force.memory import Servo
from stability.catalogue import shows

# Sets of effects that no other test plays: what is compiled once in a process stays so.
_NAIVE, _OURS = ("noise", "chaos"), ("noise", "hysteretic_spring")


def _servo(effects: tuple[str, ...]) -> Servo:
    scene = parse(
        "".join(f"[effects.{name}]\n" for name in ("pulse", *effects)), "two alterations and a pulse"
    )
    return memory.prepare(scene, block.in_memory(law_of(scene)))


def _kinds() -> int:
    dispatcher: Any = loop.run_paced
    return len(dispatcher.signatures)


@pytest.mark.long  # compiles two loops
@shows("compile pause at a change of scene")
def test_a_loop_that_is_compiled_at_its_first_tick_leaves_ticks_out_and_a_warm_one_compiles_nothing() -> None:
    naive, before = _servo(_NAIVE), _kinds()
    loop.run_paced(naive, loop.NO_LOG, time.monotonic_ns(), 1)
    assert _kinds() == before + 1
    # From the store of compiled kernels it is a tenth of a second, from nothing ten.
    assert naive.status["overruns"][0] > 10
    loop.warm_up(_servo(_OURS))
    ours, warm = _servo(_OURS), _kinds()
    assert warm == before + 2
    loop.run_paced(ours, loop.NO_LOG, time.monotonic_ns(), 100)
    assert _kinds() == warm
    assert ours.status["tick"][0] == 100
