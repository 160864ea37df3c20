"""A real `drumstick` command as a child of the test, on ports and under a rig name of its own."""

import contextlib
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec
import zenoh

from haptic_server.servo.stall_detector import StallDetector
from ports import free_port
from protocol.keys import Keys
from protocol.messages import Message, RefusalReply, State, decode
from protocol.session import open_client
from rig.folder import run_folder

DRUMSTICK = [sys.executable, "-c", "from rig.cli.command import main; main()"]
PATIENCE_S = 120.0  # how long a test waits for something that must come; kernels may have to compile first


_T = TypeVar("_T")
_M = TypeVar("_M", bound=Message)


def wait_for(what: str, get: Callable[[], _T | None], patience_s: float = PATIENCE_S) -> _T:
    """Poll until `get` returns something true."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        found = get()
        if found:
            return found
        time.sleep(0.01)
    raise AssertionError(f"waited {patience_s:.0f} s in vain for {what}")


def leave(file: Path, text: str) -> None:
    """A file that somebody watches: there at once with all of its text, as a service leaves it."""
    beside = file.with_name(f".{file.name}.test")
    beside.write_text(text)
    beside.replace(file)


def children_of(pid: int) -> list[int]:
    """Processes that its main thread started and that are there; none of one that has ended."""
    try:
        return [int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []


def services_of(pid: int) -> dict[str, int]:
    """Module name -> pid of the services of a `drumstick` command."""
    found: dict[str, int] = {}
    for child in children_of(pid):
        try:
            words = Path(f"/proc/{child}/cmdline").read_bytes().decode().split("\0")
        except (FileNotFoundError, ProcessLookupError):
            continue
        if "-m" in words:
            found[words[words.index("-m") + 1]] = child
    return found


class Rig:
    """The running command: its ports, its children, what it printed."""

    def __init__(
        self,
        part: str,
        *options: str,
        state: Path | None = None,
        name: str = "",
        stderr: int = subprocess.PIPE,
    ) -> None:
        """`state`: where it keeps its presets; its own, removed afterwards, if not given.

        `stderr`: a file descriptor that gets what would else be in `lines`."""
        self.name = name or f"test-{os.getpid()}-{free_port()}"
        self.keys = Keys(self.name)
        self.zenoh_port, self.panel_port = free_port(), free_port()
        self.osc_in, self.osc_out = free_port(), free_port()
        self.endpoint = f"tcp/127.0.0.1:{self.zenoh_port}"
        command = [*DRUMSTICK, part, "--rig", self.name]
        if part in ("up", "haptic"):
            command += ["--listen", self.endpoint]
            command += ["--osc-in", str(self.osc_in), "--osc-out", f"127.0.0.1:{self.osc_out}"]
        if part == "up":
            command += ["--panel-port", str(self.panel_port)]
            if "--audio" not in options:
                command += ["--audio", "null"]
        self._own_state = tempfile.mkdtemp(prefix="drumstick-state-")
        self.state = state or Path(self._own_state)
        self.lines: list[str] = []
        self._sessions: list[zenoh.Session] = []
        self.process = subprocess.Popen(
            [*command, *options],
            stdout=subprocess.PIPE,
            stderr=stderr,
            text=True,
            env=dict(os.environ, XDG_STATE_HOME=str(self.state)),
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self.process.stderr or ():
            self.lines.append(line.rstrip())

    @property
    def said(self) -> str:
        return "\n".join(self.lines)

    def children(self) -> dict[str, int]:
        """Module name -> pid of the services."""
        return services_of(self.process.pid)

    def client(self, patience_s: float = PATIENCE_S) -> zenoh.Session:
        """A Zenoh session of the test's own, open until the test or `close` closes it."""
        end = time.monotonic() + patience_s
        session = open_client(self.endpoint, lambda: time.monotonic() < end and self.process.poll() is None)
        assert session is not None, f"no router came up:\n{self.said}"
        self._sessions.append(session)
        wait_for("the gateway's answer", lambda: replies(session, self.keys.clock), patience_s)
        return session

    def stop(self, number: signal.Signals = signal.SIGTERM) -> int:
        """Ask the command to stop; its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.wait(PATIENCE_S)

    def summary(self) -> dict[str, Any]:
        """Output of `--json`, when the command has ended."""
        assert self.process.stdout is not None
        status = self.process.wait(PATIENCE_S * 2)
        assert status == 0, self.said
        return json.loads(self.process.stdout.read())

    def close(self) -> None:
        for session in self._sessions:  # one that a failed test left open keeps this process from ending
            session.close()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        self._reader.join(5.0)
        shutil.rmtree(run_folder(self.name), ignore_errors=True)
        shutil.rmtree(self._own_state)
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe is not None:
                pipe.close()


def stood_still_s(probes: StallDetector) -> float:
    """For how long the machine's own stalls kept the simulated stick from moving: it covers 20 ms of each, no more.

    NaN where nobody may have a higher priority than the machine's other programs: then nobody can tell.
    """
    if probes.refused:
        return math.nan
    return sum(max((ended - begun) * 1e-9 - 0.02, 0.0) for begun, ended in probes.stalls().tolist())


def assert_steady(before: State, after: State, still_s: float) -> None:
    """As many strikes between two states as the roll has in that time, but for what the machine stood still."""
    span_s = (after.t_ns - before.t_ns) * 1e-9
    made = after.strikes - before.strikes
    # What a state tells of its rate is over the newest strikes, and so lower after a stall.
    slow, quick = sorted((before.roll_rate_Hz, after.roll_rate_Hz))
    if math.isnan(still_s):
        still_s = (after.overruns - before.overruns) * 1e-3
    assert 0.95 * slow * (span_s - still_s) - 3.0 <= made, (made, span_s, still_s)
    assert made <= 1.05 * quick * span_s + 3.0, (made, span_s)
    # Each period had its tick or is counted as one that had none; how many had none is the machine's affair.
    counted = after.ticks - before.ticks + after.overruns - before.overruns
    assert abs(counted - 1e3 * span_s) <= 2.0 + 0.02 * 1e3 * span_s, (counted, span_s)


@contextmanager
def running(
    part: str, *options: str, state: Path | None = None, name: str = "", stderr: int = subprocess.PIPE
) -> Iterator[Rig]:
    rig = Rig(part, *options, state=state, name=name, stderr=stderr)
    try:
        yield rig
    finally:
        rig.close()


class Listener(Generic[_M]):
    """Collects the messages of one key."""

    def __init__(self, session: zenoh.Session, key: str, kind: type[_M]) -> None:
        self.got: list[_M] = []
        self._subscriber = session.declare_subscriber(
            key, lambda sample: self.got.append(decode(sample.payload.to_bytes(), kind))
        )


def is_subscribed(publisher: zenoh.Publisher) -> bool:
    """True while somebody hears what it puts."""
    status: Any = publisher.matching_status  # zenoh's own annotation says bool, which it is not
    return bool(status.matching)


def replies(session: zenoh.Session, key: str, encoded: bytes | None = None) -> list[zenoh.Reply]:
    """Replies to one query. Zenoh's own word that whoever is there had no time to answer is none."""
    came = list(session.get(key, payload=encoded, timeout=5.0))
    return [reply for reply in came if reply.ok is not None or reply.err.payload.to_bytes() != b"Timeout"]


def reply_to(session: zenoh.Session, key: str, encoded: bytes | None = None) -> zenoh.Reply:
    """The first reply to a query, which is asked again until somebody answers.

    A process that has just started, or that has no processor for a while, is not known to answer yet.
    """
    return wait_for(f"an answer to {key}", lambda: replies(session, key, encoded))[0]


def ask(session: zenoh.Session, key: str, payload: object = None) -> bytes:
    """One query's only good reply; AssertionError with the reason of a refusal."""
    reply = reply_to(session, key, None if payload is None else msgspec.msgpack.encode([1, payload]))
    assert reply.ok is not None, reply.err.payload.to_bytes()
    return reply.ok.payload.to_bytes()


def reason_of(reply: zenoh.Reply) -> str:
    """Reason why it was refused; AssertionError when it was not."""
    assert reply.err is not None, reply.ok.payload.to_bytes()
    return decode(reply.err.payload.to_bytes(), RefusalReply).reason


def is_alive(pid: int) -> bool:
    """True when a process exists and is not a zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


LOOPBACK = ("7F", "00000000000000000000000001000000")  # how /proc/net ends 127.x.x.x, and ::1


def bound(pid: int) -> list[str]:
    """address:port, as /proc/net writes them, of the process's internet sockets at this end."""
    inodes = set()
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):
            name = os.readlink(entry)
            if name.startswith("socket:["):
                inodes.add(name[8:-1])
    rows = [
        line.split() for kind in ("tcp", "tcp6", "udp", "udp6") if (net := Path(f"/proc/net/{kind}")).exists()
        for line in net.read_text().splitlines()[1:]
    ]  # fmt: skip
    return [row[1] for row in rows if row[9] in inodes]
