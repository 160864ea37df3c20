"""Acquire and release in the code that the compiler really made, for x86-64 and for aarch64.

Tests of threads on x86-64 cannot find a missing barrier: that processor forgives it. So the code itself is read.
"""

from typing import Any

import numpy as np
import pytest
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from haptic_server.records import EVENT, STATUS
from machine_code import AARCH64, X86_64, Compiled, Order, count, last
from realtime import atomics, ring, triple_buffer
from realtime.atomic_instructions import _cell
from realtime.atomics import load_acquire, store_release
from realtime.kernels.jit import njit

CELLS = np.zeros(24, np.int64)
EVENTS, EVENT_1, EVENT_OUT = np.zeros(8, EVENT), np.zeros(1, EVENT), np.zeros(4, EVENT)
STATUSES, STATUS_1 = np.zeros(3, STATUS), np.zeros(1, STATUS)

# kernel, arguments, what `Order.faults` is asked, and how many acquire loads, release stores, exchanges it has.
KERNELS: dict[str, tuple[Any, tuple[Any, ...], dict[str, str], tuple[int, int, int]]] = {
    "push": (ring.push, (CELLS, EVENTS, EVENT_1[0]), {"written": "slots"}, (1, 2, 0)),
    "drain": (ring.drain, (CELLS, EVENTS, EVENT_OUT), {"read": "slots"}, (1, 1, 0)),
    "publish": (triple_buffer.publish, (CELLS, STATUSES, STATUS_1[0]), {"written": "slots"}, (0, 1, 1)),
    "take": (triple_buffer.take, (CELLS,), {}, (1, 1, 1)),
    "has_fresh": (triple_buffer.has_fresh, (CELLS,), {}, (1, 0, 0)),
    "recover": (triple_buffer.recover, (CELLS, 8, 16), {}, (3, 1, 0)),
    "peek": (atomics.peek, (CELLS, 3), {}, (1, 0, 0)),
    "poke": (atomics.poke, (CELLS, 3, 7), {}, (0, 1, 0)),
    "add_to": (atomics.add_to, (CELLS, 3, 7), {}, (0, 0, 1)),
}
_made: dict[str, Compiled] = {}


def compiled(name: str) -> Compiled:
    if name not in _made:
        kernel, arguments, _, _ = KERNELS[name]
        _made[name] = Compiled(kernel, *arguments)
    return _made[name]


def atomics_of(lines: list[str], machine: str) -> tuple[int, int, int]:
    """Acquire loads, release stores and exchanges among these instructions. On x86-64 the first two are plain moves."""
    if machine == AARCH64:
        exclusive = count(lines, r"ldaxr\b")
        assert exclusive == count(lines, r"stlxr\b"), "half an exchange"
        return (
            count(lines, r"ldapr\b", r"ldar\b"),
            count(lines, r"stlr\b"),
            exclusive + count(lines, r"swpal\b"),
        )
    locked = count(lines, r"lock\b") + count(lines, r"xchgq?\s.*\(")
    return -1, -1, locked


@pytest.mark.parametrize("name", KERNELS)
def test_every_access_is_ordered_in_the_optimised_ir(name: str) -> None:
    _, _, arrays, (acquires, releases, exchanges) = KERNELS[name]
    text = Order(compiled(name))
    assert text.faults("cells", **arrays) == []
    for access, array in arrays.items():  # an empty set of accesses would prove nothing
        opcode = {"written": "store", "read": "load"}[access]
        assert any(i.is_plain(opcode, array) for _, _, i in text.everywhere())
    body = compiled(name).ir.split(f"@{compiled(name).name}(")[1].split("\n}")[0]
    assert body.count("load atomic") == body.count(" acquire, align") == acquires
    assert body.count("store atomic") == body.count(" release, align") == releases
    assert body.count("atomicrmw") == body.count(" acq_rel, align") == exchanges


def published_last(lines: list[str], machine: str) -> bool:
    """Is a record, which fills vector registers, stored before the counter or exchange that publishes it?"""
    if machine == AARCH64:
        return -1 < last(lines, r"st[rp]\s+q") < last(lines, r"stlr\b", r"stlxr\b", r"swpal\b")
    stored = last(lines, r"v?mov\w+\s+%[xyz]mm\d+, -?\w*\((?!%rsp)")
    return -1 < stored < last(lines, r"movq\s+%r\w+, -?\w*\((?!%rsp)", r"xchgq\s.*\(")


@pytest.mark.parametrize("name", KERNELS)
def test_on_aarch64_they_are_ldar_and_stlr(name: str) -> None:
    _, _, arrays, (acquires, releases, exchanges) = KERNELS[name]
    lines = compiled(name).assembly(AARCH64)
    loads, stores, swaps = atomics_of(lines, AARCH64)
    assert (loads, swaps) == (acquires, exchanges)
    assert min(releases, 1) <= stores <= releases  # two that end a function alike may become one
    assert "written" not in arrays or published_last(lines, AARCH64)


@pytest.mark.parametrize("name", KERNELS)
def test_on_x86_64_moves_are_enough_and_an_exchange_is_locked(name: str) -> None:
    _, _, arrays, (_, _, exchanges) = KERNELS[name]
    lines = compiled(name).assembly(X86_64)
    assert atomics_of(lines, X86_64)[2] == exchanges
    assert "written" not in arrays or published_last(lines, X86_64)


# The same kernels as somebody might write them by mistake. The check must not pass any.


@intrinsic
def store_relaxed(typingctx, cells, index, value):
    def codegen(context, builder, signature, args):
        index64 = context.cast(builder, args[1], signature.args[1], types.intp)
        value64 = context.cast(builder, args[2], signature.args[2], types.int64)
        builder.store_atomic(
            value64, _cell(context, builder, signature.args[0], args[0], index64), "monotonic", 8
        )
        return ir.Constant(ir.IntType(64), 0)

    return types.int64(cells, index, value), codegen


@njit()
def push_by_plain_stores(cells, slots, record):
    written = cells[0]
    if written - load_acquire(cells, 8) >= slots.shape[0]:
        return False
    slots[written % slots.shape[0]] = record
    cells[0] = written + 1
    return True


@njit()
def push_relaxed(cells, slots, record):
    written = cells[0]
    slots[written % slots.shape[0]] = record
    store_relaxed(cells, 0, written + 1)  # ty: ignore[missing-argument]  numba passes the first
    return True


@njit()
def push_too_early(cells, slots, record):
    written = cells[0]
    store_release(cells, 0, written + 1)
    slots[written % slots.shape[0]] = record
    return True


@njit()
def drain_by_plain_loads(cells, slots, out):
    read = cells[8]
    count = min(cells[0] - read, out.shape[0])
    for i in range(count):
        out[i] = slots[(read + i) % slots.shape[0]]
    store_release(cells, 8, read + count)
    return count


@njit()
def drain_too_late(cells, slots, out):
    read = cells[8]
    count = min(load_acquire(cells, 0) - read, out.shape[0])
    store_release(cells, 8, read + count)
    for i in range(count):
        out[i] = slots[(read + i) % slots.shape[0]]
    return count


WRONG: dict[str, tuple[Any, tuple[Any, ...], dict[str, str], str, tuple[int, int]]] = {
    "plain stores": (
        push_by_plain_stores, (CELLS, EVENTS, EVENT_1[0]), {"written": "slots"}, "by a plain store", (1, 0),
    ),
    "relaxed": (
        push_relaxed, (CELLS, EVENTS, EVENT_1[0]), {"written": "slots"}, "no release follows", (0, 0),
    ),
    "published before it is written": (
        push_too_early, (CELLS, EVENTS, EVENT_1[0]), {"written": "slots"}, "written after a release", (0, 1),
    ),
    "plain loads": (
        drain_by_plain_loads, (CELLS, EVENTS, EVENT_OUT), {"read": "slots"}, "before an acquire", (0, 1),
    ),
    "given back before it is read": (
        drain_too_late, (CELLS, EVENTS, EVENT_OUT), {"read": "slots"}, "no release follows", (1, 1),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_the_check_rejects_what_is_wrong(name: str) -> None:
    kernel, arguments, arrays, words, (acquires, releases) = WRONG[name]
    made = Compiled(kernel, *arguments)
    assert any(words in fault for fault in Order(made).faults("cells", **arrays))
    lines = made.assembly(AARCH64)
    assert atomics_of(lines, AARCH64)[:2] == (acquires, releases)
    if "written" in arrays:
        assert not published_last(lines, AARCH64)


def test_an_early_publish_is_seen_on_x86_64_too() -> None:
    early = Compiled(push_too_early, CELLS, EVENTS, EVENT_1[0]).assembly(X86_64)
    assert not published_last(early, X86_64)
