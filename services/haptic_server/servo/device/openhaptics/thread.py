"""The driver's own thread, which calls the servo callback: who it is, and how it is scheduled."""

import ctypes
import os
import sys

from numba import types

from haptic_server.servo.priority import FIFO_PRIORITY
from realtime.kernels.jit import njit

if sys.platform == "linux" and hasattr(ctypes.CDLL(None), "gettid"):
    _gettid = types.ExternalFunction("gettid", types.int32())

    @njit()
    def own_id() -> int:
        """Linux's number of the calling thread. Tick thread; does not block."""
        return _gettid()
else:

    @njit()
    def own_id() -> int:
        """0: this system has no such number."""
        return 0


def request_real_time(thread: int) -> str:
    """See that the driver's thread runs in real time; returns words about how it is scheduled. Control thread."""
    if thread == 0 or sys.platform != "linux":
        return "how the driver schedules its servo thread is not known here"
    names = {os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR"}
    try:
        policy = os.sched_getscheduler(thread)
        if policy in names:
            priority = os.sched_getparam(thread).sched_priority
            return f"the driver's servo thread runs under {names[policy]} {priority}"
        os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except ProcessLookupError:
        return "the driver's servo thread has ended already"
    except OSError as error:
        return (
            f"the driver's servo thread has no real-time priority: {error.strerror} (raise the rtprio limit)"
        )
    return f"the driver's servo thread was given SCHED_FIFO {FIFO_PRIORITY}"
