"""Datagrams and when the kernel took each of them in: SO_TIMESTAMPNS, put on the monotonic clock. Linux."""

import socket
import struct
import threading
import time
from typing import NamedTuple

_TIMESTAMPNS = 35  # SO_TIMESTAMPNS of Linux, by the clock of the day
_TIMESPEC = struct.Struct("qq")


class Datagram(NamedTuple):
    """One, and when it came, monotonic ns."""

    payload: bytes
    arrival_ns: int


class Arrivals:
    """Hears a UDP port of 127.0.0.1 from `__enter__` to `__exit__`; `got`: what came, afterwards."""

    def __init__(self, port: int = 0) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        self._socket.setsockopt(socket.SOL_SOCKET, _TIMESTAMPNS, 1)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(0.2)
        self.port = int(self._socket.getsockname()[1])
        self.got: list[Datagram] = []
        self._raw: list[tuple[bytes, int]] = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._hear)

    @property
    def count(self) -> int:
        """Datagrams so far."""
        return len(self._raw)

    def __enter__(self) -> "Arrivals":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def _hear(self) -> None:
        offsets: list[tuple[int, int]] = []  # ns that a comparison took; monotonic minus the clock of the day
        while not self._ended.is_set():
            try:
                payload, (beside, *_), _, _ = self._socket.recvmsg(2048, 64)
            except TimeoutError:
                continue
            before_ns, day_ns, after_ns = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
            offsets.append((after_ns - before_ns, (before_ns + after_ns) // 2 - day_ns))
            seconds, ns = _TIMESPEC.unpack(beside[2])
            self._raw.append((payload, seconds * 1_000_000_000 + ns))
        _, offset = min(offsets, default=(0, 0))
        self.got = [Datagram(payload, at_ns + offset) for payload, at_ns in self._raw]
