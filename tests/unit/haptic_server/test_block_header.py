"""The front of the block: that a servo was held outlives it, its scene, its version, and every death in between."""

import math
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server import block_header, files
from haptic_server.block_header import ARM, HEARTBEAT, HELD, PANIC, BlockError
from haptic_server.records import FAULT, OUT_OF_BOUNDS, READY
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from haptic_server.servo.process import _memory
from realtime.atomics import add_to, peek, poke

ROLL = parse(shipped_text("roll"), "roll")
BARE = Scene(name="bare")


def made(folder: Path, scene: Scene = ROLL) -> blocks.Block:
    return blocks.create(folder, law_of(scene))


def is_panicked(block: blocks.Block) -> bool:
    return bool(memory.prepare(ROLL, block).tick_state["panicked"][0])


def test_a_servo_that_is_killed_before_its_first_tick_leaves_the_panic_to_the_next(tmp_path: Path) -> None:
    poke(made(tmp_path).control, HELD, 1)
    for _ in range(3):
        assert block_header.was_held(tmp_path)
        block = made(tmp_path)
    assert is_panicked(block)


def test_a_fault_is_told_by_every_servo_after_it_until_somebody_arms(tmp_path: Path) -> None:
    servo = memory.prepare(ROLL, made(tmp_path))
    servo.motion["z"] = math.nan
    now = loop.run_virtual(servo, 1, 0)
    for _ in range(2):  # one that plays the scene before, and one that is started in its place
        block_header.invalidate(tmp_path)
        servo = memory.prepare(ROLL, made(tmp_path))
        now = loop.run_virtual(servo, 1, now)
        assert (servo.status["status"][0], servo.status["fault"][0]) == (FAULT, OUT_OF_BOUNDS)
        assert servo.tick_state["traced"][0] == 0, (
            "the ticks before the fault are on file: these are not news"
        )
        assert servo.tick_state["force_N"][0] == 0.0
    poke(servo.block.control, ARM, 1)
    loop.run_virtual(servo, 1, now)
    assert servo.status["status"][0] == READY
    assert not is_panicked(made(tmp_path))


def test_nobody_is_held_by_a_servo_that_was_not(tmp_path: Path) -> None:
    assert not block_header.was_held(tmp_path)
    assert not is_panicked(made(tmp_path))
    assert not is_panicked(made(tmp_path))


@pytest.mark.parametrize("scene", [ROLL, BARE], ids=["the same scene", "another one"])
def test_it_is_inherited_whatever_the_scene(tmp_path: Path, scene: Scene) -> None:
    add_to(made(tmp_path, scene).control, PANIC, 1)  # raised, and never seen
    assert is_panicked(made(tmp_path))


def test_it_is_inherited_from_another_version(tmp_path: Path) -> None:
    old = made(tmp_path)
    old.header[block_header.SIGNATURE_CELL] += 1
    poke(old.control, HELD, 1)
    assert is_panicked(made(tmp_path))


@pytest.mark.parametrize("rest", [b"", b"short", b"\x00" * 100_000], ids=["empty", "short", "zeros"])
def test_whoever_starts_on_what_is_no_block_starts_held(tmp_path: Path, rest: bytes) -> None:
    (tmp_path / files.BLOCK).write_bytes(rest)
    with pytest.raises(BlockError, match=files.BLOCK):
        blocks.attach(tmp_path, law_of(ROLL).dtype)
    assert block_header.was_held(tmp_path)
    block_header.invalidate(tmp_path)
    assert is_panicked(made(tmp_path))


def test_a_law_that_the_device_does_not_take_takes_no_panic_with_it(tmp_path: Path) -> None:
    from haptic_server.servo.device.simulated import Simulated
    from haptic_server.specification import EXACT_STICK

    wild = law_of(ROLL)
    wild["k_coll"] = 1e9  # of a device that could carry it
    poke(blocks.create(tmp_path, wild, 7).control, HELD, 1)
    servo = _memory(Simulated(ROLL), ROLL, tmp_path, EXACT_STICK)
    assert servo.law["k_coll"][0] == law_of(ROLL)["k_coll"][0]
    assert servo.tick_state["panicked"][0] == 1


@pytest.mark.parametrize("late", [False, True], ids=["before the new block is in place", "after it"])
def test_a_panic_between_two_servos_reaches_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, late: bool
) -> None:
    gateway = made(tmp_path)
    rename = Path.rename

    def renamed(self: Path, target: Path) -> Path:
        if late:
            rename(self, target)
        block_header.raise_panic(tmp_path, gateway.header_view)
        if not late:
            rename(self, target)
        return target

    monkeypatch.setattr(Path, "rename", renamed)
    block = made(tmp_path)
    assert block_header.is_held(block.control)
    assert is_panicked(block) or peek(block.control, PANIC) == 1


def test_a_servo_that_is_killed_while_it_takes_over_leaves_a_block_that_is_held(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made(tmp_path)
    rename = Path.rename

    def killed(self: Path, target: Path) -> Path:
        rename(self, target)
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "rename", killed)
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path)
    assert block_header.was_held(tmp_path)


def test_a_panic_goes_on_to_the_newest_of_many_blocks(tmp_path: Path) -> None:
    gateway = made(tmp_path)
    newest = [made(tmp_path) for _ in range(3)][-1]
    block_header.raise_panic(tmp_path, gateway.header_view)
    assert peek(newest.control, PANIC) == 1
    (tmp_path / files.BLOCK).write_bytes(b"nonsense")
    block_header.raise_panic(tmp_path, gateway.header_view)  # nowhere to go on to
    (tmp_path / files.BLOCK).unlink()
    block_header.raise_panic(tmp_path, gateway.header_view)
    assert peek(gateway.control, PANIC) == 3


def test_a_servo_that_is_there_and_does_not_tick_is_stuck(tmp_path: Path) -> None:
    assert not block_header.is_stuck(tmp_path)
    block = made(tmp_path)  # of this process, which lives
    assert block_header.is_stuck(tmp_path)
    poke(block.control, HEARTBEAT, time.monotonic_ns() + 3600 * 10**9)
    assert not block_header.is_stuck(tmp_path)
    poke(block.control, HEARTBEAT, 0)
    with subprocess.Popen([sys.executable, "-c", ""]) as dead:
        pass
    block.header[block_header.PID_CELL] = dead.pid
    assert not block_header.is_stuck(tmp_path)


def test_a_servo_that_has_not_ticked_yet_is_about_to_while_it_lives(tmp_path: Path) -> None:
    block = made(tmp_path)  # of this process, which lives
    assert block_header.is_about_to_tick(block.header_view)
    poke(block.control, HEARTBEAT, 1)
    assert not block_header.is_about_to_tick(block.header_view)
    poke(block.control, HEARTBEAT, 0)
    with subprocess.Popen([sys.executable, "-c", ""]) as dead:
        pass
    block.header[block_header.PID_CELL] = dead.pid
    assert not block_header.is_about_to_tick(block.header_view)
