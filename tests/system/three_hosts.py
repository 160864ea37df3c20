"""A haptic, a sound and a panel machine with the keys that `drumstick keys make` makes, and a fourth that hears OSC."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
from hosts import Host, Relay, Venue, environment
from rig_process import DRUMSTICK, PATIENCE_S, services_of, wait_for

from protocol.keys import Keys
from protocol.messages import Message, Meter, State, Strike

HAPTIC, SOUND, PANEL, DAW = "192.168.1.10", "192.168.1.20", "192.168.1.30", "192.168.1.40"
RIG = "main"
KEYS = Keys(RIG)
AHEAD_S = 1000  # the sound machine's monotonic clock
KINDS: dict[str, type[Message]] = {"state": State, "meter": Meter, "strike": Strike}


class Running:
    """A program on one of the machines; what it says is in `lines`."""

    def __init__(self, host: Host, command: Sequence[str], folder: Path, env: Mapping[str, str]) -> None:
        self.host = host
        self.lines: list[str] = []
        self.process = subprocess.Popen(
            [*host.enter, *command],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            cwd=folder, env=dict(env),
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.take(line.rstrip("\n"))

    def take(self, line: str) -> None:
        """One line; the reading thread's."""
        self.lines.append(line)

    @property
    def said(self) -> str:
        return "\n".join(self.lines)

    def children(self) -> dict[str, int]:
        """Module name -> pid of a `drumstick` command's services."""
        return services_of(self.process.pid)

    def stop(self) -> int:
        """Ask it to end; its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                self.process.kill()
        status = self.process.wait()
        self._reader.join(5.0)
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()
        return status


class Probe(Running):
    """Messages that arrive at one machine: state, meter, strike, each with that machine's time in seconds."""

    def __init__(self, host: Host, command: Sequence[str], folder: Path, env: Mapping[str, str]) -> None:
        self.got: dict[type[Message], list[tuple[float, Any]]] = {kind: [] for kind in KINDS.values()}
        super().__init__(host, command, folder, env)

    def take(self, line: str) -> None:
        if not line.startswith('["'):
            super().take(line)
            return
        name, at_s, fields = json.loads(line)
        self.got[KINDS[name]].append((at_s, msgspec.convert(fields, KINDS[name])))

    def last(self, kind: type[Any]) -> Any:
        found = self.got[kind]
        return found[-1][1] if found else None


class ThreeHosts:
    """`haptic`, `sound` and `panel` play in one venue; `cable` is the fourth machine's."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.venue = Venue()
        self.running: dict[str, Running] = {}
        self._probes: list[Running] = []
        try:
            for name, address, ahead_s in (
                ("haptic", HAPTIC, 0), ("sound", SOUND, AHEAD_S), ("panel", PANEL, 0)
            ):  # fmt: skip
                self.venue.join(name, address, ahead_s)
                (folder / name).mkdir()
            self.cable: Relay = self.venue.join_by_relay("daw", DAW)
            (folder / "daw").mkdir()
        except BaseException:
            self.close()
            raise

    def make_keys(self) -> None:
        command = [*DRUMSTICK, "keys", "make", "--out", self.folder / "keys", "--host", HAPTIC]
        subprocess.run(command, check=True, capture_output=True, timeout=PATIENCE_S)
        for role in ("haptic", "sound", "panel", "listener", "technician"):
            for machine in ("haptic", "sound", "panel"):
                shutil.copytree(self.folder / "keys" / role, self.folder / machine / role)

    def start(self, name: str, *command: str) -> Running:
        """A `drumstick` command on a machine, in its folder."""
        folder = self.folder / name
        self.running[name] = Running(
            self.venue[name], [*DRUMSTICK, *command], folder, environment(folder / "home")
        )
        return self.running[name]

    def probe(self, name: str, role: str | None = None) -> Probe:
        """Follows the play at a machine: by the certificate of `role`, or as a local process of the haptic machine."""
        end = ["tcp/127.0.0.1:7447"] if role is None else [f"tls/{HAPTIC}:7448"]
        if role is not None:
            end += [f"{role}/ca.pem", f"{role}/{role}.pem", f"{role}/{role}.key"]
        script = str(Path(__file__).with_name("wire_probe.py"))
        folder = self.folder / name
        command = [sys.executable, script, RIG, *end]
        probe = Probe(self.venue[name], command, folder, environment(folder / "home"))
        self._probes.append(probe)
        try:
            wait_for(f"state at {name}", lambda: self._all_run() and probe.last(State), 150.0)
        except AssertionError as failure:
            said = {program: running.said[-1000:] for program, running in self.running.items()}
            raise AssertionError(f"{failure}: {said}; {probe.said[-1000:]}") from None
        return probe

    def _all_run(self) -> bool:
        for name, program in self.running.items():
            assert program.process.poll() is None, f"{name} ended: {program.said}"
        return True

    def close(self) -> None:
        for program in (*reversed(self._probes), *reversed(self.running.values())):
            program.stop()
        self.venue.close()


def seconds(length_s: float) -> None:
    """Length of a fault, or of a look: it is the subject of the test."""
    time.sleep(length_s)
