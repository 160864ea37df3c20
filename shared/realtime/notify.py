"""Telling whoever supervises this process (systemd) that it is ready, alive, and how it goes.

sd_notify(3): datagrams to the socket that NOTIFY_SOCKET names. Without that variable nothing is opened and nothing
sent. One ordinary thread, never the tick's or the audio's; never blocks.
"""

import logging
import os
import select
import socket
import time
from collections.abc import Callable, Mapping

_log = logging.getLogger(__name__)
_UNWATCHED_S = 5.0  # how often the status goes out where no watchdog asks for more
_BARRIER_WITHIN_S = 5.0
_SHARES = 4  # of the watchdog's time: three may be late


def _watchdog_s(environment: Mapping[str, str]) -> float | None:
    # WATCHDOG_PID names the process that is watched; a child that inherited the variables is not.
    micros = environment.get("WATCHDOG_USEC", "")
    if not micros.isdecimal() or environment.get("WATCHDOG_PID", str(os.getpid())) != str(os.getpid()):
        return None
    return int(micros) / 1e6 or None


def _path(environment: Mapping[str, str]) -> str:
    # Of systemd's socket; "" where nobody supervises.
    named = environment.get("NOTIFY_SOCKET", "")
    return "\0" + named[1:] if named.startswith("@") else named  # in Linux' abstract namespace


def name_main_process(pid: int, environment: Mapping[str, str] = os.environ, waits: bool = True) -> None:
    """Have systemd take this process of the unit for its main one; `waits` until it has read that. Blocks.

    For a command of the unit (ExecReload), with NotifyAccess=exec. Raises OSError, TimeoutError.
    """
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as to_systemd:
        to_systemd.connect(_path(environment))
        to_systemd.send(f"MAINPID={pid}".encode())
        if not waits:
            return
        inner, outer = os.pipe()
        try:
            # sd_notify_barrier(3): what was sent before is taken up when the other end is closed everywhere.
            socket.send_fds(to_systemd, [b"BARRIER=1"], [outer])
        finally:
            os.close(outer)
        try:
            if not select.select([inner], [], [], _BARRIER_WITHIN_S)[0]:
                raise TimeoutError(f"systemd does not answer within {_BARRIER_WITHIN_S:.0f} s")
        finally:
            os.close(inner)


class Supervisor:
    """Call `notify_alive` whenever the loop that matters turned: the first says ready, later ones feed the watchdog."""

    def __init__(
        self,
        environment: Mapping[str, str] = os.environ,
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._now_s = now_s
        self._period_s = (_watchdog_s(environment) or _SHARES * _UNWATCHED_S) / _SHARES
        self._is_ready = False
        self._due_s = 0.0
        self._failed = False
        self._address = _path(environment)
        self._socket: socket.socket | None = None
        if self._address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)

    @property
    def is_due(self) -> bool:
        """True when `notify_alive` would send something: for callers whose words cost something."""
        return self._socket is not None and (not self._is_ready or self._now_s() >= self._due_s)

    def notify_alive(self, words: str) -> None:
        """The loop turned. `words`: how it goes, one line for `systemctl status`."""
        if not self.is_due:
            return
        if self._is_ready:
            self._due_s = self._now_s() + self._period_s
            self._send("WATCHDOG=1", words)
        else:  # feeds no watchdog: the next call does
            self._is_ready, self._due_s = True, 0.0
            self._send("READY=1", words)

    def notify_waiting(self, words: str) -> None:
        """Not ready, but in good order: for something that may take as long as it likes."""
        if self._is_ready or not self.is_due or self._now_s() < self._due_s:
            return
        self._due_s = self._now_s() + self._period_s
        # systemd then grants that much more time for the start, from now.
        self._send(f"EXTEND_TIMEOUT_USEC={int(3e6 * max(self._period_s, _UNWATCHED_S))}", words)

    def notify_trouble(self, words: str) -> None:
        """Tell how it goes without feeding the watchdog."""
        if self._socket is not None:
            self._send("", words)

    def _send(self, first: str, words: str) -> None:
        lines = [first, f"STATUS={' '.join(words.split())}"]
        assert self._socket is not None
        try:
            self._socket.sendto("\n".join(line for line in lines if line).encode(), self._address)
            self._failed = False
        except OSError as error:  # a supervisor that is busy or starts anew: the next time will do
            if not self._failed:
                _log.warning("the supervisor cannot be told: %s", error.strerror)
            self._failed = True
