"""The triple buffer between two compiled loops: always whole records, never an old one after a newer one."""

import threading

import numpy as np
import numpy.typing as npt
import pytest

from realtime import triple_buffer
from realtime.atomics import load_acquire, poke, store_release
from realtime.kernels.jit import njit
from realtime.records import Records

RECORDS = 1_000_000
RECORD = np.dtype([("n", "i8"), ("twice", "i8"), ("half", "f8"), ("minus", "i8")], align=True)
STARTED, DONE = 0, 8


@njit()
def _write(
    cells: npt.NDArray[np.int64], slots: Records, scratch: Records, count: int, gate: npt.NDArray[np.int64]
) -> None:
    while load_acquire(gate, STARTED) == 0:
        pass
    record = scratch[0]
    for n in range(1, count + 1):
        record.n = n
        record.twice = 2 * n
        record.half = 0.5 * n
        record.minus = -n
        triple_buffer.publish(cells, slots, record)
    store_release(gate, DONE, 1)


@njit()
def _read(
    cells: npt.NDArray[np.int64], slots: Records, gate: npt.NDArray[np.int64], seen: npt.NDArray[np.int64]
) -> int:
    # seen: reads, torn, older than the one before, fresh. Returns the last record's number.
    store_release(gate, STARTED, 1)
    last = 0
    while True:
        done = load_acquire(gate, DONE)
        fresh = triple_buffer.has_fresh(cells)
        record = slots[triple_buffer.take(cells)]
        if record.twice != 2 * record.n or record.half != 0.5 * record.n or record.minus != -record.n:
            seen[1] += 1
        if record.n < last or (fresh and record.n == last):
            seen[2] += 1
        last = record.n
        seen[0] += 1
        seen[3] += fresh
        if done == 1 and not fresh:
            return last


def test_two_threads() -> None:
    cells, gate, seen = np.zeros(triple_buffer.CELLS, np.int64), np.zeros(16, np.int64), np.zeros(4, np.int64)
    slots, scratch = np.zeros(3, RECORD), np.zeros(1, RECORD)
    triple_buffer.clear(cells, slots, scratch[0])
    writer = threading.Thread(target=_write, args=(cells, slots, scratch, RECORDS, gate), daemon=True)
    writer.start()
    last = _read(cells, slots, gate, seen)
    writer.join()
    reads, torn, older, fresh = (int(x) for x in seen)
    assert (torn, older) == (0, 0)
    assert last == RECORDS  # the newest is never lost
    assert 1 <= fresh <= reads


def _small() -> tuple[npt.NDArray[np.int64], npt.NDArray[np.void], npt.NDArray[np.void]]:
    cells, slots, record = np.zeros(triple_buffer.CELLS, np.int64), np.zeros(3, RECORD), np.zeros(1, RECORD)
    triple_buffer.clear(cells, slots, record[0])
    return cells, slots, record


def test_the_reader_keeps_its_record_until_a_newer_one_comes() -> None:
    cells, slots, record = _small()
    out = np.zeros(1, RECORD)
    assert not triple_buffer.read_into(cells, slots, out)
    for n in (1, 2, 3):
        record["n"] = n
        triple_buffer.publish(cells, slots, record[0])
    assert triple_buffer.read_into(cells, slots, out)
    assert out["n"][0] == 3
    assert not triple_buffer.read_into(cells, slots, out)
    assert out["n"][0] == 3


def test_a_record_that_comes_while_the_reader_takes_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A reader that looks before it takes calls this one old, and whoever waits for it waits for ever."""
    cells, slots, record = _small()
    out = np.zeros(1, RECORD)
    taken = triple_buffer.take

    def take_just_after_a_record(cells: npt.NDArray[np.int64]) -> int:
        record["n"] = 7
        triple_buffer.publish(cells, slots, record[0])
        return taken(cells)

    monkeypatch.setattr(triple_buffer, "take", take_just_after_a_record)
    assert triple_buffer.read_into(cells, slots, out)
    assert out["n"][0] == 7


@pytest.mark.parametrize("side", [triple_buffer.WRITER, triple_buffer.READER])
@pytest.mark.parametrize("published", [0, 1, 2, 5])
def test_a_side_that_died_after_its_exchange_gets_its_slot_back(side: int, published: int) -> None:
    """Whatever the dead process had noted as its slot, the three slots are three different ones again."""
    cells, slots, record = _small()
    for n in range(1, published + 1):
        record["n"] = n
        triple_buffer.publish(cells, slots, record[0])
        if n % 2:
            triple_buffer.take(cells)
    other = triple_buffer.READER if side == triple_buffer.WRITER else triple_buffer.WRITER
    for noted in range(3):
        poke(cells, side, noted)
        assert triple_buffer.recover(cells, side, other)
        held = {
            int(cells[triple_buffer.BETWEEN]) % triple_buffer.FRESH,
            int(cells[triple_buffer.WRITER]),
            int(cells[triple_buffer.READER]),
        }
        assert held == {0, 1, 2}
    record["n"] = 99
    triple_buffer.publish(cells, slots, record[0])
    assert slots[triple_buffer.take(cells)]["n"] == 99


def test_recover_says_no_while_the_other_side_is_between_its_two_steps() -> None:
    """The other side has exchanged, and not yet noted: its old slot is the one that now lies between."""
    cells, _, _ = _small()
    poke(cells, triple_buffer.BETWEEN, int(cells[triple_buffer.READER]))
    assert not triple_buffer.recover(cells, triple_buffer.WRITER, triple_buffer.READER)
