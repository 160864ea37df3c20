"""The block: private, whole or absent, and safe to take up again after a gateway died anywhere."""

import os
import stat
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server import block_header, files
from haptic_server.records import PANIC, set_type
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from realtime import triple_buffer
from realtime.atomics import exchange, poke
from realtime.kernels.jit import njit

ROLL = parse(shipped_text("roll"), "roll")
BARE = Scene(name="bare")


def test_it_is_private_and_shared(tmp_path: Path) -> None:
    servo = blocks.create(tmp_path, law_of(ROLL))
    gateway = blocks.attach(tmp_path, law_of(ROLL).dtype)
    assert stat.S_IMODE((tmp_path / files.BLOCK).stat().st_mode) == 0o600
    poke(servo.control, block_header.HEARTBEAT, 123)
    assert gateway.control[block_header.HEARTBEAT] == 123
    assert gateway.boot == servo.boot
    assert gateway.pid == os.getpid()


def test_a_block_of_another_scene_is_refused(tmp_path: Path) -> None:
    blocks.create(tmp_path, law_of(BARE))
    with pytest.raises(block_header.BlockError, match="expected"):
        blocks.attach(tmp_path, law_of(ROLL).dtype)


def test_absent_is_file_not_found(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        blocks.attach(tmp_path, law_of(ROLL).dtype)
    assert blocks.inode(tmp_path) == 0


def test_a_new_start_is_a_new_file_and_a_new_boot(tmp_path: Path) -> None:
    first = blocks.create(tmp_path, law_of(ROLL))
    old = blocks.inode(tmp_path)
    second = blocks.create(tmp_path, law_of(ROLL))
    assert blocks.inode(tmp_path) != old
    assert first.boot != second.boot
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux is asked to reserve the room")
def test_all_of_its_room_is_reserved_at_once(tmp_path: Path) -> None:
    # With holes, a /dev/shm that fills up later would end the servo with SIGBUS in the middle of a tick.
    blocks.create(tmp_path, law_of(ROLL))
    found = (tmp_path / files.BLOCK).stat()
    assert found.st_blocks * 512 >= found.st_size


@njit()
def _half_a_publish(cells, slots, record):
    # A writer killed after the exchange, before it noted its new slot.
    mine = cells[triple_buffer.WRITER]
    slots[mine] = record
    exchange(cells, triple_buffer.BETWEEN, mine + triple_buffer.FRESH)


def test_a_writer_killed_in_mid_publish_takes_up_the_right_slot() -> None:
    block = blocks.in_memory(law_of(ROLL))
    record = np.zeros(1, set_type(law_of(ROLL).dtype))
    out = record.copy()
    for revision in range(1, 50):
        record["revision"] = revision
        _half_a_publish(block.wanted_cells, block.wanted, record[0])
        assert triple_buffer.recover(block.wanted_cells, triple_buffer.WRITER, triple_buffer.READER)
        cells = block.wanted_cells
        slots = {
            int(cells[triple_buffer.BETWEEN]) % triple_buffer.FRESH,
            int(cells[triple_buffer.WRITER]),
            int(cells[triple_buffer.READER]),
        }
        assert slots == {0, 1, 2}
        if revision % 3:
            assert triple_buffer.read_into(block.wanted_cells, block.wanted, out)
            assert out["revision"][0] == revision


def test_sets_are_never_torn_between_threads() -> None:
    block = blocks.in_memory(law_of(ROLL))
    done = threading.Event()
    count = 200_000

    def write() -> None:
        _write_many(block.wanted_cells, block.wanted, np.zeros(1, block.wanted.dtype), count)
        done.set()

    thread = threading.Thread(target=write)
    thread.start()
    torn = reads = 0
    out = np.zeros(1, block.wanted.dtype)
    while not done.is_set() or triple_buffer.has_fresh(block.wanted_cells):
        triple_buffer.read_into(block.wanted_cells, block.wanted, out)
        reads += 1
        if out["revision"][0]:
            torn += int(
                out["law"]["m"][0] != out["revision"][0] or out["law"]["z_ss"][0] != out["revision"][0]
            )
    thread.join()
    assert torn == 0
    assert out["revision"][0] == count
    assert reads > 0


@njit()
def _write_many(cells, slots, record, count):
    for i in range(1, count + 1):
        record[0].revision = i
        record[0].law.m = i
        record[0].law.z_ss = i
        triple_buffer.publish(cells, slots, record[0])


def test_a_servo_inherits_what_was_accepted_and_whether_it_was_held(tmp_path: Path) -> None:
    old = blocks.create(tmp_path, law_of(ROLL))
    assert blocks.inherited_state(tmp_path, law_of(ROLL).dtype) == blocks.InheritedState(0, law_of(ROLL))
    wanted = np.zeros(1, set_type(law_of(ROLL).dtype))
    wanted["law"] = law_of(ROLL)
    wanted["law"]["pulse"]["dv_pls"] = 0.3
    wanted["revision"] = 9
    triple_buffer.publish(old.wanted_cells, old.wanted, wanted[0])
    poke(old.control, block_header.PANIC, 1)  # raised, but the servo died before it saw it
    left = blocks.inherited_state(tmp_path, law_of(ROLL).dtype)
    assert left is not None
    assert left.revision == 9
    assert left.law["pulse"]["dv_pls"][0] == 0.3
    new = blocks.create(tmp_path, left.law, left.revision)
    servo = memory.prepare(ROLL, new)
    loop.run_virtual(servo, 3, 0)
    assert servo.law["pulse"]["dv_pls"][0] == 0.3
    assert servo.status["revision"][0] == 9
    assert servo.status["status"][0] == PANIC


def test_nothing_is_inherited_from_another_scene_or_from_nobody(tmp_path: Path) -> None:
    assert blocks.inherited_state(tmp_path, law_of(ROLL).dtype) is None
    blocks.create(tmp_path, law_of(BARE))
    assert blocks.inherited_state(tmp_path, law_of(ROLL).dtype) is None
