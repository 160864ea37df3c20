"""Real-time settings of the servo thread on Linux: SCHED_FIFO, locked memory, no timer slack. Best effort, reported.

Call `claim` from the very thread that will run the loop, before it does.
"""

import ctypes
import os
import sys

FIFO_PRIORITY = 80
_PR_SET_TIMERSLACK = 29
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4


def _lock_memory() -> str:
    # ONFAULT: 121 MB instead of 385 MB with every library loaded (measured with numba and zenoh in the process).
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mlockall(_MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT) == 0:
        return "locked"
    return f"refused: {os.strerror(ctypes.get_errno())} (raise the memlock limit)"


def no_timer_slack() -> str:
    """Let this thread's sleeps end when they should, not up to 50 us later; what was granted. Linux only."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(_PR_SET_TIMERSLACK, 1, 0, 0, 0) == 0:
        return "1 ns"
    return f"refused: {os.strerror(ctypes.get_errno())}"


def _scheduler() -> str:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except OSError as error:
        return f"refused: {error.strerror} (raise the rtprio limit)"
    return f"SCHED_FIFO {FIFO_PRIORITY}"


def _affinity(cpu: int) -> str:
    if cpu < 0:
        return "left to the system"
    try:
        os.sched_setaffinity(0, {cpu})
    except OSError as error:
        return f"refused: processor {cpu}: {error.strerror} (there are {sorted(os.sched_getaffinity(0))})"
    return f"processor {cpu}"


def claim(cpu: int = -1) -> dict[str, str]:
    """Ask for everything; returns what was granted or why not, by name. `cpu`: stay on this processor; -1: on any."""
    if not sys.platform.startswith("linux"):
        return {"scheduler": f"refused: real-time scheduling is only done on Linux, this is {sys.platform}"}
    return {
        "scheduler": _scheduler(),
        "memory": _lock_memory(),
        "timer_slack": no_timer_slack(),
        "affinity": _affinity(cpu),
    }
