"""CPU time of this thread, of several pieces of work in turn, beside yardsticks whose work never changes.

What else the machine does then falls on all alike, so what is to be compared is timed in one call. Of each the best
run counts, and its ratio to a yardstick of the same rounds is what two runs, or two machines, may be compared by. Each
part of a result keeps its yardsticks' own time as `yardstick_ns`: where that differs, so did the machine.
"""

import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import njit

Window = Callable[[], float]  # does its work and returns CPU time, in any unit
CHAIN, SWEEP = "chain", "sweep"  # the yardsticks' names
ENGINES = 3  # of what is compared with another: where an engine happens to lie in memory costs too
_LINKS = 200_000
_WIDTH, _SWEEPS = 4096, 200  # 48 kB in all: it stays in the processor's first caches


def spent_ns(work: Callable[[], object]) -> float:
    """ns of CPU of this thread."""
    begun = time.thread_time_ns()
    work()
    return float(time.thread_time_ns() - begun)


def each_in_turn(windows: Mapping[str, Window], rounds: int) -> dict[str, list[float]]:
    """Times of each window in so many rounds, after one that is not counted."""
    for window in windows.values():
        window()
    found = [{name: window() for name, window in windows.items()} for _ in range(rounds)]
    return {name: [each[name] for each in found] for name in windows}


def in_turn(windows: Mapping[str, Window], rounds: int) -> dict[str, float]:
    """Least time of each window, likewise."""
    return {name: min(times) for name, times in each_in_turn(windows, rounds).items()}


def median_band(times: Sequence[float]) -> tuple[float, float]:
    """Band in which the median of such times lies with 95 % confidence, whatever their distribution: two of them, by
    the binomial law of how many fall below it (Hahn, Meeker, Statistical Intervals, 5.2). All of them for five and
    fewer, which hold it with less confidence."""
    there, below, chance = sorted(times), 0, 0.0
    while below < len(there) // 2:
        chance += math.comb(len(there), below) * 0.5 ** len(there)
        if chance > 0.025:
            break
        below += 1
    lowest = max(below - 1, 0)
    return there[lowest], there[len(there) - 1 - lowest]


def apart(some: Sequence[float], others: Sequence[float]) -> tuple[float, float]:
    """Extra cost of some engines over as many others: the median, and half of what their differences span."""
    off = [one - other for one, other in zip(some, others, strict=True)]
    return statistics.median(off), 0.5 * (max(off) - min(off))


@njit()
def _chain(links: int) -> float:
    # Each step needs the one before: what a stick costs, whose instants follow one another.
    x = 0.5
    for _ in range(links):
        x = x * 0.999 + 1e-3
    return x


@njit()
def _sweep(
    out: npt.NDArray[np.float32], one: npt.NDArray[np.float32], other: npt.NDArray[np.float32]
) -> None:
    # Side by side: what a membrane costs, whose junctions are independent within a step.
    for _ in range(_SWEEPS):
        for k in range(1, out.shape[0] - 1):
            out[k] = np.float32(0.5) * (one[k - 1] + one[k + 1]) - other[k]


def chain() -> Window:
    """ns of a multiplication and an addition in float64, each waiting for the one before."""
    return lambda: spent_ns(lambda: _chain(_LINKS)) / _LINKS


def plain_sweep() -> Window:
    """ns of a point of a string in float32, written plainly, as numba vectorizes it."""
    rows = [np.linspace(0.0, 1e-3, _WIDTH, dtype=np.float32) for _ in range(3)]
    return lambda: spent_ns(lambda: _sweep(*rows)) / (_SWEEPS * (_WIDTH - 2))
