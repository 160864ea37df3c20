"""One process of a rig as systemd starts it: a notify socket, a watchdog, `drumstick service`."""

import contextlib
import ctypes
import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from rig_process import DRUMSTICK, wait_for

_PTRACE_DETACH, _PTRACE_SEIZE, _PTRACE_INTERRUPT = 17, 0x4206, 0x4207
_WALL = 0x40000000
WATCHDOG_S = 0.4


class Supervised:
    """The process and what it told its supervisor: (when, first line, status)."""

    def __init__(self, folder: Path, *words: str, environment: dict[str, str] | None = None) -> None:
        self.told: list[tuple[float, str, str]] = []
        self.lines: list[str] = []
        self._address = folder / f"notify-{time.monotonic_ns()}"
        self._ear = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._ear.bind(str(self._address))
        self._ear.settimeout(0.1)
        self._over = False
        self._threads = [threading.Thread(target=run, daemon=True) for run in (self._hear, self._read)]
        self.environment = {
            **(os.environ if environment is None else environment),
            "NOTIFY_SOCKET": str(self._address),
        }
        self.process = subprocess.Popen(
            [*DRUMSTICK, "service", *words],
            stderr=subprocess.PIPE,
            text=True,
            cwd=folder,
            env={**self.environment, "WATCHDOG_USEC": str(int(WATCHDOG_S * 1e6))},
        )
        for thread in self._threads:
            thread.start()

    def _hear(self) -> None:
        while not self._over:
            with contextlib.suppress(TimeoutError):
                data, barriers, _, _ = socket.recv_fds(self._ear, 4096, 1)
                for barrier in barriers:  # sd_notify_barrier(3): whoever sent it waits until it is closed
                    os.close(barrier)
                words, _, status = data.decode().partition("\n")
                self.told.append((time.monotonic(), words, status.removeprefix("STATUS=")))

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.lines.append(line.rstrip())

    def count(self, words: str) -> int:
        return sum(first == words for _, first, _ in list(self.told))

    def ready(self) -> None:
        """Wait until it says so."""

        def is_over() -> bool:
            assert self.process.poll() is None, (self.process.returncode, self.lines)
            return self.count("READY=1") > 0

        wait_for("READY=1", is_over, 240.0)

    def ended(self) -> int:
        """Its exit status, when it ends by itself; `lines` is complete then."""
        status = self.process.wait(240.0)
        self._threads[1].join(10.0)
        return status

    def fed(self, times: int) -> None:
        """Wait for so many more words to the watchdog."""
        before = self.count("WATCHDOG=1")
        wait_for("the watchdog to be fed", lambda: self.count("WATCHDOG=1") >= before + times)

    def says(self, *words: str) -> None:
        """Wait until it has told its supervisor one of these, whatever else it says meanwhile on a busy machine."""
        wait_for(
            " or ".join(words),
            lambda: any(each in status for _, _, status in list(self.told) for each in words),
        )

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(10.0)
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self._over = True
        for thread in self._threads:
            thread.join(10.0)
        assert self.process.stderr is not None
        self.process.stderr.close()
        self._ear.close()


@contextlib.contextmanager
def supervised(folder: Path, *words: str, environment: dict[str, str] | None = None) -> Iterator[Supervised]:
    """`drumstick service WORDS`, gone afterwards."""
    made = Supervised(folder, *words, environment=environment)
    try:
        yield made
    finally:
        made.close()


def fifo_threads(pid: int) -> list[int]:
    """The threads of a process that have real-time priority."""
    tids = [int(entry.name) for entry in Path(f"/proc/{pid}/task").iterdir()]
    return [tid for tid in tids if os.sched_getscheduler(tid) == os.SCHED_FIFO]


@contextlib.contextmanager
def hung(thread: int) -> Iterator[None]:
    """This one thread stands still, as in a driver that does not return; all others of its process go on."""
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    assert libc.ptrace(_PTRACE_SEIZE, thread, None, None) == 0, os.strerror(ctypes.get_errno())
    try:
        assert libc.ptrace(_PTRACE_INTERRUPT, thread, None, None) == 0
        assert os.waitpid(thread, _WALL)[0] == thread
        yield
    finally:
        libc.ptrace(_PTRACE_DETACH, thread, None, None)
