"""Real-time threads that only sleep, one on each processor, and note when it stood still: as those of the force loop.

The servo's witnesses (haptic_server.servo.stall_detector) wake five thousand times a second, which costs a thread that
computes beside them a third of its speed on a virtual machine. These wake every two milliseconds: they miss the shorter
stalls, and so excuse less. Linux.
"""

import os
import sys
import threading

import numpy as np
import numpy.typing as npt

from realtime.atomics import load_acquire, poke
from realtime.clock import now_ns, sleep_until
from realtime.kernels.jit import njit

PERIOD_NS = 2_000_000
_NOTED_NS = 100_000  # a wake-up this late is a stall
_MOST = 65536
_PRIORITY = 99
Numbers = npt.NDArray[np.int64]


@njit()
def _watch(stop: Numbers, stalls: Numbers, clock: Numbers) -> int:
    found = 0
    due = now_ns(clock) + PERIOD_NS
    while load_acquire(stop, 0) == 0:
        sleep_until(clock, due)
        now = now_ns(clock)
        if now - due > _NOTED_NS and found < stalls.shape[0]:
            stalls[found, 0], stalls[found, 1] = due, now
            found += 1
        due = now + PERIOD_NS
    return found


class StallWitnesses:
    """Watching from `__enter__` to `__exit__`. `refused`: processors whose witness did not get its priority;
    or why there are none."""

    def __init__(self) -> None:
        self._stop = np.zeros(8, np.int64)
        self._threads: list[threading.Thread] = []
        self._stalls: list[Numbers] = []
        self.refused: list[str] = []

    def __enter__(self) -> "StallWitnesses":
        if not sys.platform.startswith("linux"):
            self.refused.append(f"witnesses run only on Linux, this is {sys.platform}")
            return self
        _watch(
            np.ones(8, np.int64), np.zeros((1, 2), np.int64), np.zeros(2, np.int64)
        )  # compiled before it counts
        for cpu in sorted(os.sched_getaffinity(0)):
            thread = threading.Thread(target=self._testify, args=(cpu,), daemon=True)
            thread.start()
            self._threads.append(thread)
        return self

    def _testify(self, cpu: int) -> None:
        try:
            os.sched_setaffinity(0, {cpu})
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        except OSError as error:
            self.refused.append(f"processor {cpu}: {error.strerror}")
        stalls = np.zeros((_MOST, 2), np.int64)
        self._stalls.append(stalls[: _watch(self._stop, stalls, np.zeros(2, np.int64))])

    def __exit__(self, *_: object) -> None:
        poke(self._stop, 0, 1)
        for thread in self._threads:
            thread.join()

    def stalls(self) -> Numbers:
        """All stalls that were seen, shape (n, 2): from, to, in ns of the monotonic clock; after `__exit__`."""
        return np.concatenate([np.zeros((0, 2), np.int64), *self._stalls])
