"""A thread of the force loop's rate and priority that has nothing to do but one datagram now and then: the witness.

What it is late by, no program on this machine can do better; what its datagrams take from their tick to the socket they
go to is what the machine's own sockets cost. Linux.
"""

import os
import socket
import struct
import threading
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types

from haptic_server.servo.priority import FIFO_PRIORITY
from realtime.atomics import load_acquire, poke
from realtime.clock import now_ns, sleep_until
from realtime.kernels.jit import njit

PERIOD_NS = 1_000_000
EVERY = 40  # ticks from datagram to datagram: about a roll
NUMBER = struct.Struct("<q")
_MOST = 1 << 19
# ssize_t send(int, const void *, size_t, int)
_send: Any = types.ExternalFunction("send", types.intp(types.int32, types.intp, types.intp, types.int32))
Times = npt.NDArray[np.int64]


@njit()
def _run(stop: Times, late: Times, begun_ns: int, timespec: Times, descriptor: int) -> int:
    number = np.zeros(1, np.int64)
    for tick in range(late.shape[0]):
        due = begun_ns + tick * PERIOD_NS
        sleep_until(timespec, due)
        late[tick] = now_ns(timespec) - due
        if load_acquire(stop, 0) != 0:
            return tick
        if tick % EVERY == 0:
            number[0] = due
            _send(descriptor, number.ctypes.data, 8, 0)
    return late.shape[0]


class IdleThread:
    """Runs from `__enter__` to `__exit__`. `late_ns`: of each tick, afterwards. Its datagrams hold when their tick was
    due, monotonic ns. `refused`: why it had an ordinary priority, or empty."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._stop = np.zeros(8, np.int64)
        self._late = np.zeros(_MOST, np.int64)
        self.late_ns = self._late[:0]
        self.refused = ""
        self._thread = threading.Thread(target=self._work)

    def __enter__(self) -> "IdleThread":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        poke(self._stop, 0, 1)
        self._thread.join()

    def _work(self) -> None:
        timespec = np.zeros(2, np.int64)
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
        except OSError as error:
            self.refused = error.strerror or str(error)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.connect(("127.0.0.1", self._port))
            _run(np.ones(8, np.int64), self._late, now_ns(timespec), timespec, udp.fileno())  # compiled
            begun = now_ns(timespec) + PERIOD_NS
            self.late_ns = self._late[: _run(self._stop, self._late, begun, timespec, udp.fileno())]
