"""Ten million records each way, between threads and between processes: none torn, none lost, every drop counted.

The writers and readers are compiled and run without the GIL, at full speed and with pauses that vary how they
interleave; between processes they share the very block that servo and gateway share.
"""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import transport
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.records import EVENT
from realtime import ring, triple_buffer
from realtime.atomics import peek
from stability.catalogue import shows
from transport import AT_ONCE, DISORDERED, GAPS, GATE_CELLS, LAST, RECEIVED, SEEN, SET, TORN

STEADY, PAUSING = 0, 12345
RECORDS = {STEADY: 10_000_000, PAUSING: 2_000_000}


def _new(*shapes: tuple[int, Any]) -> list[npt.NDArray[Any]]:
    return [np.zeros(count, kind) for count, kind in shapes]


def _through_a_ring(slots: int, wait: bool, seed: int, count: int) -> tuple[int, list[int], int]:
    """Pushed; seen; dropped."""
    cells = ring.new_cells()
    memory, scratch, out = _new((slots, EVENT), (1, EVENT), (AT_ONCE, EVENT))
    gate, seen = _new((GATE_CELLS, np.int64), (SEEN, np.int64))
    thread, pushed = transport.alongside(transport.push_all, cells, memory, scratch, count, wait, gate, seed)
    transport.drain_all(cells, memory, out, gate, seed + 2 * (seed != STEADY), seen)
    thread.join()
    assert peek(cells, ring.WRITTEN) == peek(cells, ring.READ) == pushed[0]
    return pushed[0], [int(x) for x in seen], peek(cells, ring.DROPPED)


@pytest.mark.long
@pytest.mark.parametrize("seed", RECORDS)
@pytest.mark.parametrize("slots", [5, 1024])
def test_a_ring_whose_writer_waits_loses_nothing(slots: int, seed: int) -> None:
    count = (
        RECORDS[seed] if slots > 5 else RECORDS[seed] // 10
    )  # so small a ring makes them wait for each other
    pushed, seen, _ = _through_a_ring(slots, wait=True, seed=seed, count=count)
    assert pushed == seen[RECEIVED] == seen[LAST] == count
    assert (seen[TORN], seen[DISORDERED], seen[GAPS]) == (0, 0, 0)


@pytest.mark.daily("16-0")
@shows("reader that stands still", "ours")
@pytest.mark.parametrize("seed", RECORDS)
@pytest.mark.parametrize("slots", [16, blocks.RING_SLOTS])
def test_a_ring_whose_writer_does_not_wait_counts_every_drop(slots: int, seed: int) -> None:
    pushed, seen, dropped = _through_a_ring(slots, wait=False, seed=seed, count=RECORDS[seed])
    assert (seen[TORN], seen[DISORDERED]) == (0, 0)
    assert pushed == seen[RECEIVED]
    assert pushed + dropped == RECORDS[seed]
    assert seen[GAPS] + RECORDS[seed] - seen[LAST] == dropped, "each gap is a drop, and each drop a gap"


@shows("set of another thread", "ours")
@pytest.mark.parametrize("seed", RECORDS)
def test_a_triple_buffer_gives_whole_sets_and_the_newest_one(seed: int) -> None:
    cells = np.zeros(triple_buffer.CELLS, np.int64)
    slots, scratch = _new((3, SET), (1, SET))
    gate, seen = _new((GATE_CELLS, np.int64), (SEEN, np.int64))
    transport.fill_set(scratch[0], 0)
    triple_buffer.clear(cells, slots, scratch[0])
    thread, _ = transport.alongside(transport.publish_all, cells, slots, scratch, RECORDS[seed], gate, seed)
    transport.take_all(cells, slots, gate, seed + 2 * (seed != STEADY), seen)
    thread.join()
    assert (seen[TORN], seen[DISORDERED], seen[LAST]) == (0, 0, RECORDS[seed])
    assert seen[RECEIVED] > seen[GAPS]
    held = [
        peek(cells, c) % triple_buffer.FRESH
        for c in (triple_buffer.BETWEEN, triple_buffer.WRITER, triple_buffer.READER)
    ]
    assert sorted(held) == [0, 1, 2]


def _other_process(what: str, folder: Path, seed: int) -> subprocess.Popen[str]:
    command = [sys.executable, transport.__file__, what, str(folder), str(RECORDS[seed]), str(seed)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def _block(folder: Path) -> blocks.Block:
    block = blocks.create(folder, law_of(transport.ROLL))
    transport.fill_set(block.wanted[0], 0)
    triple_buffer.clear(block.wanted_cells, block.wanted, block.wanted[0])
    return block


@pytest.mark.daily("0")
@pytest.mark.parametrize("seed", RECORDS)
def test_events_reach_another_process(tmp_path: Path, seed: int) -> None:
    block = _block(tmp_path)
    with _other_process("drain", tmp_path, seed) as gateway:
        gate = transport.gate_of(block)
        cells, slots = block.ring_cells, block.events
        pushed = transport.push_all(cells, slots, np.zeros(1, EVENT), RECORDS[seed], True, gate, seed)
        seen = json.loads(gateway.communicate(timeout=100)[0])
    assert pushed == seen[RECEIVED] == seen[LAST] == RECORDS[seed]
    assert (seen[TORN], seen[DISORDERED], seen[GAPS]) == (0, 0, 0)


@pytest.mark.daily("0")
@shows("set of another thread", "ours")
@pytest.mark.parametrize("seed", RECORDS)
def test_sets_of_another_process_come_whole(tmp_path: Path, seed: int) -> None:
    block, seen = _block(tmp_path), np.zeros(SEEN, np.int64)
    with _other_process("publish", tmp_path, seed) as gateway:
        transport.take_all(block.wanted_cells, block.wanted, transport.gate_of(block), seed, seen)
        gateway.communicate(timeout=100)
    assert gateway.returncode == 0
    assert (seen[TORN], seen[DISORDERED], seen[LAST]) == (0, 0, RECORDS[seed])


@pytest.mark.parametrize("at", range(1, EVENT.itemsize))
def test_the_reader_would_see_an_event_torn_at_any_byte(at: int) -> None:
    """Bytes of one event up to here, of another from here on. What both have in common tears unseen, and harmlessly."""
    old, new = _new((1, EVENT), (1, EVENT))
    transport.fill_event(old[0], 0x0123456789AB)
    transport.fill_event(new[0], 0x02FEDCBA9876)
    torn = np.frombuffer(new.tobytes()[:at] + old.tobytes()[at:], EVENT)
    same = torn.tobytes() in (old.tobytes(), new.tobytes())
    assert transport.whole_event(torn[0]) == same


def _half_written(slot: npt.NDArray[np.void], new: npt.NDArray[np.void]) -> None:
    half = SET.itemsize // 16 * 8
    slot.view(np.uint8)[:half] = new.view(np.uint8)[:half]


@shows("set of another thread")
def test_a_writer_that_is_stopped_half_way_shows_nothing_of_it() -> None:
    """A set that is copied over the one in use is half old and half new meanwhile; here it lies beside it."""
    cells = np.zeros(triple_buffer.CELLS, np.int64)
    slots, new, naive = _new((3, SET), (1, SET), (1, SET))
    transport.fill_set(naive[0], 1)
    transport.fill_set(new[0], 2)
    triple_buffer.clear(cells, slots, naive[0])
    _half_written(naive, new)
    assert not transport.whole_set(naive[0])

    writing = peek(cells, triple_buffer.WRITER)
    _half_written(slots[writing : writing + 1], new)
    taken = slots[triple_buffer.take(cells)]
    assert transport.whole_set(taken)
    triple_buffer.publish(cells, slots, new[0])
    taken = slots[triple_buffer.take(cells)]
    assert transport.whole_set(taken)
    assert taken.tobytes() == new[0].tobytes()
