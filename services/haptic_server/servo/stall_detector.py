"""Probes: threads of the highest real-time priority, one on each processor, that notice when it stands still.

A virtual machine's host may stop a processor for tens of milliseconds; no program on it can help that. What a probe
of priority 99 saw as well, the force loop is not to blame for. Probes that wake five thousand times a second cost a
thread that computes beside them a third of its speed on a virtual machine: beside audio they wake less often
(`SELDOM_NS`), miss the shorter stalls, and so excuse less. `watch` runs without the GIL; the rest belongs to a control
thread.
"""

import os
import sys
import threading
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.atomics import load_acquire, poke
from realtime.clock import now_ns, sleep_until
from realtime.kernels.jit import njit

OFTEN_NS, SELDOM_NS = 200_000, 2_000_000
_NOTED_NS = 100_000  # a wake-up this late is a stall
_MAX_STALLS = 65536
_PRIORITY = 99
_STOP = 0

Stalls = npt.NDArray[np.int64]
Times = npt.NDArray[np.int64]


@njit()
def watch(
    cells: npt.NDArray[np.int64], stalls: Stalls, timespec: npt.NDArray[np.int64], period_ns: int
) -> int:
    """Note [from, to) of every late wake-up until cells[0] is set; returns how many, at most len(stalls)."""
    found = 0
    due = now_ns(timespec) + period_ns
    while load_acquire(cells, _STOP) == 0:
        sleep_until(timespec, due)
        now = now_ns(timespec)
        if now - due > _NOTED_NS and found < stalls.shape[0]:
            stalls[found, 0] = due
            stalls[found, 1] = now
            found += 1
        due = now + period_ns
    return found


class StallProbe(NamedTuple):
    """One running probe."""

    thread: threading.Thread
    stalls: Stalls
    found: list[int]


def _run_probe(
    cpu: int,
    cells: npt.NDArray[np.int64],
    stalls: Stalls,
    found: list[int],
    refused: list[str],
    period_ns: int,
) -> None:
    try:
        os.sched_setaffinity(0, {cpu})
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
    except OSError as error:
        refused.append(f"processor {cpu}: {error.strerror}")
    found.append(watch(cells, stalls, np.zeros(2, np.int64), period_ns))


class StallDetector:
    """Probes on every processor of this process, from `__enter__` to `__exit__`; Linux only.

    period_ns: how often each wakes. `refused` says where the priority was not granted: such a probe is late itself, and
    excuses too much.
    """

    def __init__(self, period_ns: int = OFTEN_NS) -> None:
        self._period_ns = period_ns
        self._cells = np.zeros(8, np.int64)
        self._running: list[StallProbe] = []
        self.refused: list[str] = []

    def __enter__(self) -> "StallDetector":
        if not sys.platform.startswith("linux"):
            self.refused.append(f"witnesses run only on Linux, this is {sys.platform}")
            return self
        watch(
            np.ones(8, np.int64), np.zeros((1, 2), np.int64), np.zeros(2, np.int64), self._period_ns
        )  # compiled before it counts
        for cpu in sorted(os.sched_getaffinity(0)):
            stalls, found = np.zeros((_MAX_STALLS, 2), np.int64), list[int]()
            given = (cpu, self._cells, stalls, found, self.refused, self._period_ns)
            thread = threading.Thread(target=_run_probe, args=given, name=f"stall probe {cpu}", daemon=True)
            thread.start()
            self._running.append(StallProbe(thread, stalls, found))
        return self

    def __exit__(self, *_: object) -> None:
        poke(self._cells, _STOP, 1)
        for probe in self._running:
            probe.thread.join()

    def stalls(self) -> Stalls:
        """All stalls that were seen, shape (n, 2): from, to in ns of the monotonic clock; after `__exit__`."""
        seen = [probe.stalls[: probe.found[0]] for probe in self._running if probe.found]
        return np.concatenate(seen) if seen else np.zeros((0, 2), np.int64)


def _merged(stalls: Stalls) -> Stalls:
    # Stalls in the order of time, those that overlap or touch made one.
    merged: list[list[int]] = []
    for begun, ended in sorted((int(b), int(e)) for b, e in stalls):
        if merged and begun <= merged[-1][1]:
            merged[-1][1] = max(merged[-1][1], ended)
        else:
            merged.append([begun, ended])
    return np.array(merged, np.int64).reshape(-1, 2)


def without_host_stalls(due_ns: Times, late_ns: Times, stalls: Stalls) -> Times:
    """Lateness, ns, less the part of [due, due + late) in which some probe saw its processor stand still."""
    left = late_ns.copy()
    for begun, ended in _merged(stalls):
        overlap = np.minimum(due_ns + late_ns, ended) - np.maximum(due_ns, begun)
        left -= np.clip(overlap, 0, None)
    return left
