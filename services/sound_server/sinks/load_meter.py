"""Playing the mixer under a stopwatch: the load of the audio thread, in any sink."""

import numpy as np
import numpy.typing as npt

from realtime.clock import now_ns
from realtime.kernels.jit import njit
from realtime.records import Records
from sound_server.mixer import MixBuffers, mix
from sound_server.sinks.sink import NOTED, SinkCounters

_SMOOTHING_S = 0.2


@njit()
def timed_block(
    buffers: MixBuffers,
    counters: Records,
    out: npt.NDArray[np.float32],
    start_ns: int,
    clock: npt.NDArray[np.int64],
) -> None:
    """mixer.mix, with load, calls and noted of `counters` brought up to date. Audio thread; no allocation.

    `clock` is the thread's own timespec, int64 of shape (2,).
    """
    counts: SinkCounters = counters[0]
    before = now_ns(clock)
    mix(buffers, out, counts.rate_Hz, start_ns)
    block_s = out.shape[0] / counts.rate_Hz
    spent_ns = now_ns(clock) - before
    note = counts.noted[counts.calls % NOTED]
    note[0], note[1], note[2] = before, spent_ns, buffers.begun.sum()
    share = spent_ns * 1e-9 / block_s
    counts.load += min(1.0, block_s / _SMOOTHING_S) * (share - counts.load)
    counts.calls += 1


def noted(counters: Records) -> npt.NDArray[np.int64]:
    """The newest blocks, oldest first, int64 of shape (n, 3): begun, ns; spent, ns; pulses so far. Any thread.

    A block that is played meanwhile can show in the oldest row.
    """
    calls = int(counters["calls"][0])
    turned = np.roll(counters["noted"][0], -(calls % NOTED), axis=0)
    return turned[NOTED - min(calls, NOTED) :]
