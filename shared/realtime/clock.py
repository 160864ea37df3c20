"""Monotonic time and sleeping for compiled loops, straight from libc: no GIL, no allocation.

`buffer` is an int64 array of shape (2,), the thread's own timespec.
"""

import sys
from typing import Any

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import deferred, njit

# The clock of Python's monotonic time: CLOCK_MONOTONIC, on macOS CLOCK_UPTIME_RAW.
_CLOCK = 8 if sys.platform == "darwin" else 1
_TIMER_ABSTIME = 1


def _libc(name: str, *arguments: str) -> Any:
    """A function of libc that returns an int, for compiled code; arguments by their numba types."""

    def make() -> Any:
        from numba import types

        return types.ExternalFunction(name, types.int32(*(getattr(types, each) for each in arguments)))

    return deferred(make)


_clock_gettime = _libc("clock_gettime", "int32", "intp")
_clock_nanosleep = _libc("clock_nanosleep", "int32", "int32", "intp", "intp")
_nanosleep = _libc("nanosleep", "intp", "intp")


@njit()
def now_ns(buffer: npt.NDArray[np.int64]) -> int:
    """Nanoseconds of the clock of `time.monotonic_ns()`. Linux, macOS."""
    _clock_gettime(_CLOCK, buffer.ctypes.data)
    return buffer[0] * 1_000_000_000 + buffer[1]


@njit()
def _sleep_until(buffer: npt.NDArray[np.int64], deadline_ns: int) -> None:
    buffer[0] = deadline_ns // 1_000_000_000
    buffer[1] = deadline_ns % 1_000_000_000
    _clock_nanosleep(_CLOCK, _TIMER_ABSTIME, buffer.ctypes.data, 0)


@njit()
def sleep_for_the_rest(buffer: npt.NDArray[np.int64], deadline_ns: int) -> None:
    """Sleep as on macOS, which has no sleep to an absolute time: a preemption before the call is added."""
    left_ns = deadline_ns - now_ns(buffer)
    if left_ns > 0:
        buffer[0] = left_ns // 1_000_000_000
        buffer[1] = left_ns % 1_000_000_000
        _nanosleep(buffer.ctypes.data, 0)


# sleep_until(buffer, deadline_ns): to an absolute time of the same clock, at once when it has passed. A signal ends it
# early.
sleep_until = sleep_for_the_rest if sys.platform == "darwin" else _sleep_until


@njit()
def wait_until(buffer: npt.NDArray[np.int64], deadline_ns: int, spin_ns: int) -> None:
    """Like `sleep_until`, but awake for the last spin_ns: less lateness for a share of the processor."""
    sleep_until(buffer, deadline_ns - spin_ns)
    while spin_ns > 0 and now_ns(buffer) < deadline_ns:
        pass
