"""Machines on one switch, as network namespaces: cables that can be pulled, a clock of its own, bad weather.

Each namespace is held by a process that ends when its input closes, so nothing outlives the test, however it ends,
and nothing has a name that another run could have. Needs root on Linux.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from rig_process import PATIENCE_S

SWITCH = "switch"
_HOLD = ["sh", "-c", "echo ready; exec cat"]
_TUN_FOLLOWS = Path(__file__).with_name("tap_relay.py")


def require_root() -> None:
    """Skip, with the reason, where namespaces and cables cannot be made."""
    missing = [program for program in ("ip", "nft", "nsenter", "unshare") if shutil.which(program) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} not found: sudo apt-get install iproute2 nftables util-linux")
    tried = subprocess.run(["unshare", "--net", "ip", "link"], capture_output=True, text=True, check=False)
    if tried.returncode != 0:
        pytest.skip(f"network namespaces cannot be made here (not root?): {tried.stderr.strip()}")


class Host:
    """One machine: a network namespace, and a monotonic clock that is `ahead_s` ahead of the others'."""

    def __init__(self, name: str, ahead_s: int = 0) -> None:
        self.name = name
        clock = ["--time", "--monotonic", str(ahead_s)] if ahead_s else []
        self._holder = subprocess.Popen(
            ["unshare", "--net", *clock, *_HOLD], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._holder.stdout is not None
        assert self._holder.stdout.readline() == "ready\n", f"no namespace for {name}"
        self.pid = self._holder.pid
        self.enter = ["nsenter", f"--net=/proc/{self.pid}/ns/net"]
        if ahead_s:
            self.enter.append(f"--time=/proc/{self.pid}/ns/time_for_children")
        self.enter.append("--")
        self.run("ip", "link", "set", "dev", "lo", "up")

    def run(self, *command: str, **options: Any) -> str:
        """Output of a command that succeeds on this machine."""
        done = subprocess.run(
            [*self.enter, *command],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
            **options,
        )
        assert done.returncode == 0, f"{self.name}: {command}: {done.stdout}{done.stderr}"
        return done.stdout

    def processes(self) -> list[int]:
        """Every process of this machine but the one that holds it."""
        ours = os.stat(f"/proc/{self.pid}/ns/net").st_ino
        found: list[int] = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdigit() and int(entry.name) != self.pid:
                with contextlib.suppress(OSError):  # it ended meanwhile
                    if os.stat(entry / "ns" / "net").st_ino == ours:
                        found.append(int(entry.name))
        return found

    def close(self) -> None:
        for pid in self.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        for pipe in (self._holder.stdin, self._holder.stdout):
            assert pipe is not None
            pipe.close()
        self._holder.wait(PATIENCE_S)


class Venue:
    """Machines on one switch, 192.168.1.0/24."""

    def __init__(self) -> None:
        self._hosts: dict[str, Host] = {}
        self._relays: list[subprocess.Popen[str]] = []
        self._add(SWITCH)
        self._hosts[SWITCH].run("ip", "link", "add", "name", "br0", "type", "bridge")
        self._hosts[SWITCH].run("ip", "link", "set", "dev", "br0", "up")

    def __getitem__(self, name: str) -> Host:
        return self._hosts[name]

    def _add(self, name: str, ahead_s: int = 0) -> Host:
        assert len(self._hosts) < 8
        self._hosts[name] = Host(name, ahead_s)
        return self._hosts[name]

    def join(self, name: str, address: str, ahead_s: int = 0) -> Host:
        """A machine with a cable to the switch."""
        host = self._add(name, ahead_s)
        ends = ["type", "veth", "peer", "name", "eth0", "netns", str(host.pid)]
        self._hosts[SWITCH].run("ip", "link", "add", "name", f"p-{name}", *ends)
        self._plug(host, address)
        return host

    def join_by_relay(self, name: str, address: str) -> Relay:
        """A machine behind a piece of cable that can lose, hold and overtake frames."""
        host = self._add(name)
        relay = Relay(self._hosts[SWITCH], host, f"p-{name}")
        self._relays.append(relay.process)
        self._plug(host, address)
        return relay

    def _plug(self, host: Host, address: str) -> None:
        port = f"p-{host.name}"
        self._hosts[SWITCH].run("ip", "link", "set", "dev", port, "master", "br0", "up")
        host.run("ip", "addr", "add", f"{address}/24", "dev", "eth0")
        host.run("ip", "link", "set", "dev", "eth0", "up")

    def pull(self, name: str) -> None:
        """The machine's cable out of the switch: it sees that the link is gone."""
        self._hosts[SWITCH].run("ip", "link", "set", "dev", f"p-{name}", "down")

    def plug(self, name: str) -> None:
        self._hosts[SWITCH].run("ip", "link", "set", "dev", f"p-{name}", "up")

    @contextlib.contextmanager
    def losing(self, percent: int) -> Iterator[None]:
        """The switch loses this share of all frames, at random."""
        chain = "chain forward { type filter hook forward priority 0;"
        lossy = f"table bridge weather {{ {chain} numgen random mod 100 < {percent} counter drop; }}\n}}\n"
        self._hosts[SWITCH].run("nft", "-f", "-", input=lossy)
        try:
            yield
        finally:
            self._hosts[SWITCH].run("nft", "delete", "table", "bridge", "weather")

    def lost(self) -> int:
        """Number of frames that it has lost since `losing` began."""
        listed = self._hosts[SWITCH].run("nft", "list", "table", "bridge", "weather").split()
        return int(listed[listed.index("packets") + 1])

    def close(self) -> None:
        for host in reversed(self._hosts.values()):
            host.close()
        for relay in self._relays:
            for pipe in (relay.stdin, relay.stdout):
                assert pipe is not None
                pipe.close()
            relay.wait(PATIENCE_S)


class Relay:
    """A cable made of a process; `weather` says what it does to frames."""

    def __init__(self, switch: Host, host: Host, port: str) -> None:
        self.process = subprocess.Popen(
            [*switch.enter, sys.executable, str(_TUN_FOLLOWS), port, f"/proc/{host.pid}/ns/net"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"

    def weather(self, lost: float, overtaken: float) -> None:
        """Shares of the frames that are lost, and that some later ones overtake."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{lost} {overtaken}\n")
        self.process.stdin.flush()


def environment(folder: Path) -> Mapping[str, str]:
    """Environment of one machine's programs: folders of its own, all but the cache of compiled kernels."""
    cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    own = dict(os.environ, XDG_CACHE_HOME=cache, HOME=str(folder))
    for variable, name in (("XDG_RUNTIME_DIR", "run"), ("XDG_STATE_HOME", "state")):
        (folder / name).mkdir(mode=0o700, parents=True, exist_ok=True)
        own[variable] = str(folder / name)
    own["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), own.get("PATH", os.defpath)])
    return own


@contextlib.contextmanager
def stopped(pids: list[int]) -> Iterator[None]:
    """As a machine that stands still."""
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)
