"""Atomic cells for compiled code: acquire loads, release stores, exchange and add on int64 arrays.

Any thread; never blocks, never allocates. A plain read of an array cell in a compiled loop is hoisted out of
it and never sees another thread's write; these are real atomic instructions (x86-64 and aarch64). The
compiled code is also the only way in for Python, through `peek` and `poke`, so that both ends carry the
ordering.
"""

from realtime.kernels.jit import deferred, njit


def _instruction(name):
    # In numba's own language, which is loaded with the first kernel that is called.
    def make():
        from realtime import atomic_instructions

        return getattr(atomic_instructions, name)

    return deferred(make)


# cells[index], and everything written before its release store is visible.
load_acquire = _instruction("load_acquire")
# (cells, index, value): cells[index] = value, after everything written before.
store_release = _instruction("store_release")
# (cells, index, value) -> the old value.
exchange, add = _instruction("exchange"), _instruction("add")
# Full fence: orders a seqlock's data reads before its second counter read.
fence = _instruction("fence")


@njit()
def peek(cells, index):
    """Acquire load from Python; int64 array, index -> int."""
    return load_acquire(cells, index)


@njit()
def poke(cells, index, value):
    """Release store from Python."""
    store_release(cells, index, value)


@njit()
def add_to(cells, index, value):
    """Atomic add from Python; returns the old value."""
    return add(cells, index, value)
