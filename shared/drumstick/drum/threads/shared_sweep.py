"""The first head's sweep, by one thread or by two, where the scene asks for them (`[mesh] threads`).

The mesh is cut into parts, some strips each. In each step the audio thread takes them from the first on, one at a time,
the second thread from the last: who comes later or is slower takes fewer, and each has nearly always the same ones,
near its own core. Nobody waits for a thread that is not there: the audio thread then takes all of them itself. Only
for a part that was begun it waits, some microseconds. The samples are the same, whoever computes them.

`swept`: the engine's own thread. `help_along`: the second thread. No allocation, no locks; the second one sleeps while
there is nothing to do.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import composition
from drumstick.drum.engine import Control, Engine
from drumstick.drum.membrane.sweep import sweep, sweep_strips
from drumstick.drum.membrane.terms import Terms
from drumstick.drum.memory.shared_sweep import DONE, FIRST_MASK, PARTS, SECOND_ONE, STOP, TAKEN, SharedSweep
from realtime.atomics import add, load_acquire, store_release
from realtime.clock import now_ns, sleep_until
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit

Floats = npt.NDArray[np.float32]
# Turns without a part to take, about 1 ns each, until the second thread sleeps: longer than what lies between two steps
# of a block, be it that another head is computed there. It looks again every 50 us, and every millisecond when nothing
# has come for a while.
_LOOKS = 60_000
_SHORT_NS, _SHORT_SLEEPS, _LONG_NS = 50_000, 400, 1_000_000


@njit()
def _terms(engine: Engine, q: float) -> Terms:
    control: Control = engine.control[0]
    return Terms(
        u_gain=np.float32(control.u_gain - composition.own_loss(engine, q)),
        u_old_gain=control.u_old_gain,
        neighbour_gain=composition.neighbour_gain(engine, q),
        push=composition.head_push(engine),
        momentum=composition.momentum(engine),
        rho=composition.rho(engine),
        eta=composition.eta(engine),
        extra=None,
        extra_gain=None,
        total=composition.asked_sum(engine),
    )


@njit()
def sweep_part(engine: Engine, part: int) -> None:
    """Compute one part of the step that was begun. The thread that took it."""
    shared: SharedSweep = engine.shared_sweep
    control: Control = engine.control[0]
    levels = engine.head.time_levels
    u, u_old = levels[control.present_level], levels[1 - control.present_level]
    terms = _terms(engine, shared.q[0])
    shared.sums[part] = sweep_strips(
        engine.head, u, u_old, terms, shared.strips[part], shared.strips[part + 1]
    )


@njit()
def swept(engine: Engine, shared: Any, u: Floats, u_old: Floats, q: float) -> float:
    """Put u+ into `u_old`; returns its sum where a second head asks for it.

    shared: the engine's shared_sweep; q: by how much the tension is raised.
    """
    if shared is None:  # decided by the type, at compile time
        return sweep(engine.head, u, u_old, _terms(engine, q))
    cells, own = shared.cells, 0
    shared.q[0] = q
    store_release(cells, DONE, 0)
    store_release(cells, TAKEN, 0)
    while own + (add(cells, TAKEN, 1) // SECOND_ONE) < PARTS:
        sweep_part(engine, own)
        own += 1
    while load_acquire(cells, DONE) < PARTS - own:
        pass
    total = 0.0
    for part in range(PARTS):
        total += shared.sums[part]
    return total


@njit()
def _taken(cell: int) -> int:
    return (cell & FIRST_MASK) + cell // SECOND_ONE


@njit()
def help_along(engine: Engine, clock: npt.NDArray[np.int64]) -> None:
    """Take parts of every step, until STOP is set. clock: int64, shape (2,), this thread's own."""
    engine = borrowed_view(engine)
    shared: SharedSweep = engine.shared_sweep
    cells = shared.cells
    mode = flush_denormals()
    idle = 0
    while load_acquire(cells, STOP) == 0:
        if _taken(load_acquire(cells, TAKEN)) < PARTS:
            before = add(cells, TAKEN, SECOND_ONE)
            if _taken(before) < PARTS:
                sweep_part(engine, PARTS - 1 - before // SECOND_ONE)
                add(cells, DONE, 1)
                idle = 0
        idle += 1
        if idle > _LOOKS:
            pause_ns = _SHORT_NS if idle < _LOOKS + _SHORT_SLEEPS else _LONG_NS
            sleep_until(clock, now_ns(clock) + pause_ns)
    restore(mode)
