"""Lines to a stream that may block, be full or have no reader. A thread of its own writes them, so nobody waits.

What finds the queue full, or cannot be written, is counted; one line says how much that was when lines flow again.
Ordinary threads only, never a tick's or the audio's.
"""

import os
import queue
import select
import threading
from collections.abc import Callable

MAX_WAITING = 1000


class LineWriter:
    """Writes to the file descriptor `fd`; None: to nobody. `worded` makes a whole line of what this says itself."""

    def __init__(self, fd: int | None, worded: Callable[[str], str] = "{}\n".format) -> None:
        self._fd = fd
        self._worded = worded
        self._queue: queue.Queue[bytes] = queue.Queue(MAX_WAITING)
        self._lock = threading.Lock()
        self._refused = 0  # of those that put
        self._failed = 0  # of the writing thread, as is the next one
        self._reported = 0
        threading.Thread(target=self._run, name="lines", daemon=True).start()

    @property
    def is_idle(self) -> bool:
        """True when nothing waits to be written. Any thread."""
        return self._queue.unfinished_tasks == 0

    @property
    def lost(self) -> int:
        """Number of texts that found the queue full or could not be written. Any thread."""
        return self._refused + self._failed

    def put(self, text: str) -> None:
        """Queue `text`, or count it where the queue is full. Any thread; never blocks, never raises."""
        try:
            self._queue.put_nowait(text.encode("utf-8", "backslashreplace"))
        except queue.Full:
            with self._lock:
                self._refused += 1

    def flush(self, within_s: float = 1.0) -> bool:
        """Wait until everything is written, at most so long; whether it is. Any thread but the writing one."""
        with self._queue.all_tasks_done:
            return self._queue.all_tasks_done.wait_for(lambda: self.is_idle, within_s)

    # The writing thread

    def _run(self) -> None:
        while True:
            if not self._write(self._queue.get()):
                self._failed += 1
            elif self._queue.empty():
                self._report()
            self._queue.task_done()

    def _report(self) -> None:
        lost = self.lost
        words = f"{lost - self._reported} lines are missing here: they could not be written"
        if lost > self._reported and self._write(self._worded(words).encode()):
            self._reported = lost

    def _write(self, content: bytes) -> bool:
        # Straight to the descriptor: a buffered stream whose lock this thread held would stop the process' end.
        if self._fd is None:
            return False
        rest = memoryview(content)
        while rest:
            try:
                rest = rest[os.write(self._fd, rest) :]
            except BlockingIOError:  # a pipe that somebody made so that writing to it never blocks
                writable = select.poll()
                writable.register(self._fd, select.POLLOUT)
                writable.poll()
            except OSError:  # no reader, a full disk, a terminal that is gone, closed
                return False
        return True
