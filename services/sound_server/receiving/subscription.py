"""A subscription that can be ended while its session goes on; its samples are taken on a thread of its own."""

import queue
import threading
import time
from collections.abc import Callable

import zenoh

_MAX_WAITING = 256


class Subscription:
    """Calls `take(key, payload, monotonic ns of its arrival)` for every sample of `key`, on one thread, until closed.

    Samples that come while 256 wait are dropped. (A ring channel's reader could not be called back from `recv`.)
    """

    def __init__(self, session: zenoh.Session, key: str, take: Callable[[str, bytes, int], None]) -> None:
        self._take = take
        self._waiting: queue.SimpleQueue[tuple[str, bytes, int] | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, name=key.rpartition("/")[2], daemon=True)
        self._reader.start()
        self._subscriber = session.declare_subscriber(key, self._enqueue)

    def close(self) -> None:
        """Hear no more. The main thread; waits for the reader."""
        self._subscriber.undeclare()
        self.end()

    def end(self) -> None:
        """Like `close`, when the session is closed already."""
        self._waiting.put(None)
        self._reader.join()

    def _enqueue(self, sample: zenoh.Sample) -> None:
        # On zenoh's own thread, which must not wait.
        if self._waiting.qsize() < _MAX_WAITING:
            self._waiting.put((str(sample.key_expr), sample.payload.to_bytes(), time.monotonic_ns()))

    def _read(self) -> None:
        while (heard := self._waiting.get()) is not None:
            self._take(*heard)
