"""Messages that stop a reader: numbers that are none, nests and bundles without end, floods, a reader that is away."""

import logging
import math
import queue
import sys
import tracemalloc
from collections.abc import Callable
from types import FrameType
from typing import Any

import msgspec
import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle

from haptic_server.gateway.osc.prescan import Unreadable, prescan
from osc_mutants import KILLERS
from protocol.messages import Strike, decode, encode
from protocol.rate_limited_log import RateLimitedLog
from realtime import ring
from realtime.atomics import peek
from stability.catalogue import shows

RECORD = np.dtype([("n", "i8")])


@shows("NaN in a message")
@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_a_number_that_is_none_is_read_by_msgpack_and_not_by_ours(value: float) -> None:
    strike = Strike(
        boot=7, seq=1, t_ns=5, x=0.1, y=0.2, z_speed_m_per_s=0.6, level=0.3, peak_estimate_N=value,
        contact_estimate_s=0.005,
    )  # fmt: skip
    naive = msgspec.msgpack.decode(encode(strike), type=Strike)
    assert not math.isfinite(naive.peak_estimate_N)
    assert not (naive.peak_estimate_N < 0.0 or naive.peak_estimate_N > 1e4) or value == math.inf
    with pytest.raises(ValueError, match="peak_estimate_N"):
        decode(encode(strike), Strike)


class EndlessLoop(Exception):
    """More lines of Python were run than any message of that length can need."""


def _bounded(lines: int) -> Any:
    def trace(_frame: FrameType, event: str, _argument: object) -> Any:
        nonlocal lines
        lines -= event == "line"
        if lines < 0:
            raise EndlessLoop
        return trace

    return trace


@shows("message that never ends")
def test_a_bundle_of_minus_four_bytes_holds_the_usual_parser_for_ever() -> None:
    """24 bytes: its only element ends four bytes before it begins, so the next one is itself."""
    killer = KILLERS[0]
    before = sys.gettrace()
    sys.settrace(_bounded(100_000))
    try:
        with pytest.raises(EndlessLoop):
            OscBundle(killer)
        sys.settrace(_bounded(200))
        found = prescan(killer)
    finally:
        sys.settrace(before)
    assert isinstance(found, Unreadable)


@shows("message that never ends")
def test_a_nest_of_arrays_ends_the_usual_reader_by_another_exception() -> None:
    nest = b"\x91" * 2000 + b"\xc0"
    with pytest.raises(RecursionError):
        msgspec.msgpack.decode(nest)
    with pytest.raises(ValueError, match="not a Strike"):
        decode(nest, Strike)


@shows("flood of nonsense")
def test_a_flood_fills_no_log(caplog: pytest.LogCaptureFixture) -> None:
    """Ten thousand in three seconds: a line for each, or one a second that counts the others."""
    now_ns = 0
    limited_log = RateLimitedLog(lambda: now_ns)
    with caplog.at_level(logging.WARNING):
        for _ in range(10_000):
            now_ns += 300_000
            limited_log.warn("nonsense")
        ours = len(caplog.records)
        caplog.clear()
        for _ in range(10_000):
            logging.warning("nonsense")
        naive = len(caplog.records)
    assert naive == 10_000
    assert ours <= 4


@shows("reader that stands still")
def test_a_reader_that_stands_still_costs_no_memory_and_no_tick() -> None:
    """A queue without an end keeps all that nobody reads; the ring drops, counts, and goes on when it is read."""
    cells, slots, record, out = (
        ring.new_cells(),
        np.zeros(64, RECORD),
        np.zeros(1, RECORD),
        np.zeros(64, RECORD),
    )
    naive: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    record["n"] = -1
    ring.push(cells, slots, record[0])  # compiles
    ring.drain(cells, slots, out)

    def grown(put: Callable[[], object]) -> int:
        before = tracemalloc.get_traced_memory()[0]
        for n in range(10_000):
            record["n"] = n
            put()
        return tracemalloc.get_traced_memory()[0] - before

    tracemalloc.start()
    try:
        unbounded = grown(lambda: naive.put(record.tobytes()))
        bounded = min(grown(lambda: ring.push(cells, slots, record[0])) for _ in range(3))
    finally:
        tracemalloc.stop()
    assert unbounded > 10_000 * RECORD.itemsize
    assert bounded < 1000
    assert naive.qsize() == 10_000  # all of them late, before the first that is new
    assert peek(cells, ring.DROPPED) == 30_000 - 64
    assert ring.drain(cells, slots, out) == 64
    assert np.array_equal(out["n"], np.arange(64))
    assert ring.push(cells, slots, record[0])
