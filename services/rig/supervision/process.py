"""One service as a child process: started, listened to, restarted when it dies, stopped cleanly.

The supervisor's only thread; nothing here blocks.
"""

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from io import FileIO

_PR_SET_PDEATHSIG = 1
_FIRST_DELAY_S, _MAX_DELAY_S = 0.1, 5.0
_STEADY_AFTER_S = 10.0
if sys.platform == "linux":
    _LIBC = ctypes.CDLL(None)
_REAL_FAULTS = (
    2,
    3,
)  # exit statuses that no restart mends: what was given is wrong, or the machine lacks something


def _die_with_parent() -> None:
    # In the child, before exec: if the supervisor is killed outright, no orphan stays behind.
    if sys.platform == "linux":
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


class Service:
    """A child that should be running.

    One that is not `essential` never ends the others: when it ended by itself, or cannot run here (now or when it is
    started again), that is said once and it stays away; when it crashed it is started again like any other.
    """

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        say: Callable[[str], None],
        essential: bool = True,
        pass_fds: Sequence[int] = (),
    ) -> None:
        self.name = name
        self.essential = essential
        self.restarts = 0
        self.fault_status: int | None = None
        self.last_line = ""
        self._command = list(command)
        self._pass_fds = pass_fds
        self._say = say
        self._process: subprocess.Popen[bytes] | None = None
        self._output: FileIO | None = None  # what the child prints
        self._partial = b""
        self._delay_s = _FIRST_DELAY_S
        self._started_at = 0.0
        self._restart_at = 0.0
        self._gone = False  # not essential, and over
        self._is_first = True  # never restarted since it was started

    def start(self) -> None:
        """Start the child in a process group of its own: Ctrl-C reaches only the supervisor."""
        inner, outer = os.pipe()
        # The child's end too: what a driver's library prints there must not hold up sound while this process stands.
        os.set_blocking(inner, False)
        os.set_blocking(outer, False)
        self._output = open(inner, "rb", buffering=0)  # noqa: SIM115  as long as the child lives
        try:
            self._process = subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=outer,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=self._pass_fds,
                preexec_fn=_die_with_parent,
            )
        finally:
            os.close(outer)
        self._started_at = time.monotonic()

    def start_anew(self) -> None:
        """Start it as at the very first time, after it was stopped: it may find that it cannot run now."""
        self.fault_status = None
        self._is_first = True
        self._delay_s = _FIRST_DELAY_S
        self._try_to_start(time.monotonic())

    def _try_to_start(self, now: float) -> None:
        # A machine that has no process or descriptor left for a moment must not end what still plays.
        try:
            self.start()
        except OSError as error:
            self._close()
            self._wait(f"cannot be started: {error.strerror}; trying again", now)

    def _wait(self, why: str, now: float) -> None:
        self._say(f"[{self.name}] {why}")
        self._restart_at = now + self._delay_s
        self._delay_s = min(self._delay_s * 2.0, _MAX_DELAY_S)

    @property
    def pid(self) -> int | None:
        """Process id of the running child."""
        return self._process.pid if self._process and self._process.poll() is None else None

    def _read(self) -> None:
        if self._output is None:
            return
        while chunk := self._output.read(65536):
            *lines, self._partial = (self._partial + chunk).split(b"\n")
            for line in lines:
                self._pass_on(line)

    def _pass_on(self, line: bytes) -> None:
        text = line.decode("utf-8", "replace").rstrip()
        if text:
            self.last_line = text
            self._say(f"[{self.name}] {text}")

    def take_over(self, other: "Service") -> None:
        """Have the child of `other` in place of the one that was stopped, as if it were started anew here."""
        self._process, self._output, self._partial = other._process, other._output, other._partial
        self._started_at, self._delay_s = other._started_at, _FIRST_DELAY_S
        self.last_line, self.fault_status, self._is_first = other.last_line, None, True
        other._process = other._output = None

    def poll(self, now: float) -> None:
        """Pass on what the child printed; restart it if it died."""
        self._read()
        if self._process is None:
            if self.fault_status is None and not self._gone and now >= self._restart_at:
                self.restarts += 1
                self._is_first = False
                self._try_to_start(now)
            return
        status = self._process.poll()
        if status is None:
            return
        self._close()
        if not self.essential and status in (0, *_REAL_FAULTS):
            self._gone = True
            self._say(f"[{self.name}] ended with status {status}; the rig plays on without it")
            return
        # Only at the first start: a port that is taken while a service restarts must not end the others, force first.
        if status in _REAL_FAULTS and self._is_first:
            self.fault_status = status
            return
        if now - self._started_at > _STEADY_AFTER_S:
            self._delay_s = _FIRST_DELAY_S
        ended = (
            f"was ended by {signal.Signals(-status).name}" if status < 0 else f"ended with status {status}"
        )
        self._wait(f"{ended}; restarting", now)

    def _close(self) -> None:
        self._read()
        if self._output is not None:
            if self._partial:
                self._pass_on(self._partial)
            self._output.close()
            self._output = None
        self._partial = b""
        self._process = None

    def ask_to_stop(self) -> None:
        """SIGTERM."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()

    def wait_stopped(self, deadline: float, *, complain: bool = True) -> bool:
        """Wait for the child's end until `deadline` (monotonic), then kill it. False when it was killed."""
        if self._process is None:
            return True
        while self._process.poll() is None and time.monotonic() < deadline:
            self._read()
            time.sleep(0.01)
        stopped = self._process.poll() is not None
        if not stopped:
            self._process.kill()
            self._process.wait()
            if complain:
                self._say(f"[{self.name}] did not stop when asked; killed")
        self._close()
        return stopped
