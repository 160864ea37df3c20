"""Subscriptions that can be ended while their session goes on; their samples are taken on one thread of their own."""

import queue
import threading
import time
from collections.abc import Callable, Sequence

import zenoh

_MAX_WAITING = 256


class Subscription:
    """Calls `take(key, payload, monotonic ns of its arrival)` for every sample of these keys, on one thread, in the
    order in which they came, until closed.

    Samples that come while 256 wait are dropped. (A ring channel's reader could not be called back from `recv`.)
    """

    def __init__(
        self, session: zenoh.Session, keys: Sequence[str], take: Callable[[str, bytes, int], None]
    ) -> None:
        self._take = take
        self._waiting: queue.SimpleQueue[tuple[str, bytes, int] | None] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, name=keys[0].rpartition("/")[2], daemon=True)
        self._reader.start()
        # Not by way of zenoh's own threads, one for each callback: the order of two keys would be lost.
        self._subscribers = [
            session.declare_subscriber(key, zenoh.handlers.Callback(self._enqueue, indirect=False))
            for key in keys
        ]

    def close(self) -> None:
        """Hear no more. The main thread; waits for the reader."""
        for subscriber in self._subscribers:
            subscriber.undeclare()
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
