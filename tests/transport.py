"""Writers and readers for the ring and the triple buffer, compiled, with pauses that vary how they interleave.

Each record is made from its number alone, every field of it, so that one which is half old and half new shows. Run as a
script, this is the other process: `python transport.py drain|publish FOLDER COUNT` on the block in FOLDER.
"""

import json
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.records import EVENT, ContactEvent, set_type
from realtime import ring, triple_buffer
from realtime.atomics import load_acquire, poke, store_release
from realtime.kernels.jit import njit
from realtime.records import Records

Cells = npt.NDArray[np.int64]
ROLL = parse(shipped_text("roll"), "roll")
SET = set_type(law_of(ROLL).dtype)
AT_ONCE = 64

# Cells of a gate: both sides are up; the writer is done; steady (0) or the seed of its pauses.
READER_UP, WRITER_UP, DONE = 0, 8, 16
GATE_CELLS = 24
# What a reader has seen.
RECEIVED, TORN, DISORDERED, GAPS, LAST = 0, 1, 2, 3, 4
SEEN = 5

_yield = types.ExternalFunction("sched_yield", types.int32())


@njit()
def _wait_for(gate: Cells, cell: int) -> None:
    while load_acquire(gate, cell) == 0:
        _yield()


@njit()
def pause(gate: Cells, state: int) -> int:
    """Mostly nothing, now and then a few or some hundred loads, seldom the processor for somebody else; next state."""
    if state == 0:
        return 0
    state = (state * 6364136223846793005 + 1442695040888963407) | 1
    draw = (state >> 33) & 0xFFFF
    if draw < 16:
        _yield()
    elif draw < 512:
        for _ in range(draw):
            load_acquire(gate, DONE)
    return state


@njit()
def fill_event(event: ContactEvent, n: int) -> None:
    """All of an EVENT's fields from n."""
    event.kind = n
    event.seq = -n
    event.t_ns = n * 0x10001
    event.x = n
    event.y = -n
    event.speed_m_per_s = 0.5 * n
    event.impulse_N_s = 2.0 * n
    event.contact_s = n + 0.25
    event.level = n - 0.25
    event.peak_N = 3.0 * n


@njit()
def whole_event(event: ContactEvent) -> bool:
    """Do all fields belong to one n?"""
    n = event.kind
    return (
        event.seq == -n
        and event.t_ns == n * 0x10001
        and event.x == n
        and event.y == -n
        and event.speed_m_per_s == 0.5 * n
        and event.impulse_N_s == 2.0 * n
        and event.contact_s == n + 0.25
        and event.level == n - 0.25
        and event.peak_N == 3.0 * n
    )


@njit()
def fill_set(record: Any, n: int) -> None:
    """The revision and all numbers of a set from n."""
    record.revision = n
    record.law.pulse.dv_pls = n
    record.law.pulse.tau = -n
    record.law.m = 0.5 * n
    record.law.k_coll = 2.0 * n
    record.law.r_in = n + 0.25
    record.law.k_hand = n - 0.25
    record.law.r_out = 3.0 * n
    record.law.z_ss = -3.0 * n


@njit()
def whole_set(record: Any) -> bool:
    """Do all numbers belong to one n?"""
    n, law = record.revision, record.law
    return (
        law.pulse.dv_pls == n
        and law.pulse.tau == -n
        and law.m == 0.5 * n
        and law.k_coll == 2.0 * n
        and law.r_in == n + 0.25
        and law.k_hand == n - 0.25
        and law.r_out == 3.0 * n
        and law.z_ss == -3.0 * n
    )


@njit()
def push_all(
    cells: Cells, slots: Records, scratch: Records, count: int, wait: bool, gate: Cells, seed: int
) -> int:
    """Push events 1 .. count; with `wait` again and again while the ring is full. How many went in."""
    store_release(gate, WRITER_UP, 1)
    _wait_for(gate, READER_UP)
    event, pushed, state = scratch[0], 0, seed
    for n in range(1, count + 1):
        fill_event(event, n)
        done = ring.push(cells, slots, event)
        while wait and not done:
            _yield()
            done = ring.push(cells, slots, event)
        pushed += done
        state = pause(gate, state)
    store_release(gate, DONE, 1)
    return pushed


@njit()
def drain_all(cells: Cells, slots: Records, out: Records, gate: Cells, seed: int, seen: Cells) -> None:
    """Drain until the writer is done and the ring empty; what was seen goes into `seen`."""
    store_release(gate, READER_UP, 1)
    _wait_for(gate, WRITER_UP)
    last, state = 0, seed
    while True:
        done = load_acquire(gate, DONE)
        count = ring.drain(cells, slots, out)
        for i in range(count):
            n = out[i].kind
            seen[TORN] += not whole_event(out[i])
            seen[DISORDERED] += n <= last
            seen[GAPS] += n - last - 1
            last = n
        seen[RECEIVED] += count
        if count == 0:
            if done == 1:
                seen[LAST] = last
                return
            _yield()
        state = pause(gate, state)


@njit()
def publish_all(cells: Cells, slots: Records, scratch: Records, count: int, gate: Cells, seed: int) -> None:
    """Publish sets 1 .. count."""
    store_release(gate, WRITER_UP, 1)
    _wait_for(gate, READER_UP)
    record, state = scratch[0], seed
    for n in range(1, count + 1):
        fill_set(record, n)
        triple_buffer.publish(cells, slots, record)
        state = pause(gate, state)
    store_release(gate, DONE, 1)


@njit()
def take_all(cells: Cells, slots: Records, gate: Cells, seed: int, seen: Cells) -> None:
    """Read until the writer is done and nothing is fresh. GAPS counts reads of a set that had been seen."""
    store_release(gate, READER_UP, 1)
    _wait_for(gate, WRITER_UP)
    last, state = 0, seed
    while True:
        done = load_acquire(gate, DONE)
        fresh = triple_buffer.has_fresh(cells)
        record = slots[triple_buffer.take(cells)]
        n = record.revision
        seen[TORN] += not whole_set(record)
        seen[DISORDERED] += n < last or (fresh and n == last)
        seen[GAPS] += not fresh
        seen[RECEIVED] += 1
        last = n
        if done == 1 and not fresh:
            seen[LAST] = last
            return
        state = pause(gate, state)


def gate_of(block: blocks.Block) -> Cells:
    """The part of a block that no test of transport uses for anything else."""
    return block.lateness[:GATE_CELLS]


def alongside(work: Any, *arguments: Any) -> tuple[threading.Thread, list[Any]]:
    """Compiled work on a thread of its own; its result is in the list when the thread has ended."""
    result: list[Any] = []
    thread = threading.Thread(target=lambda: result.append(work(*arguments)), daemon=True)
    thread.start()
    return thread, result


def main() -> None:
    """The other process."""
    what, folder, count, seed = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    block = blocks.attach(folder, SET["law"])
    blocks.claim(block)
    gate, seen = gate_of(block), np.zeros(SEEN, np.int64)
    if what == "drain":
        drain_all(block.ring_cells, block.events, np.zeros(AT_ONCE, EVENT), gate, seed, seen)
    else:
        publish_all(block.wanted_cells, block.wanted, np.zeros(1, SET), count, gate, seed)
    poke(gate, READER_UP, 1)
    print(json.dumps([int(x) for x in seen]))


if __name__ == "__main__":
    main()
