"""The rig that soaks in real time: `drumstick up` as it is, with a recorder, and the companions beside it."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import table_of
from drumstick_lab.soak import usage
from drumstick_lab.soak.processes import companion
from rig.folder import run_folder

_DRUMSTICK = (sys.executable, "-c", "from rig.cli.command import main; main()")
_STOP_WITHIN_S = 20.0
# Which parameter the visitor moves: the first of these that the scene has.
_MOVED = ("dv_pls", "gamma", "k_hand")
_VISIT_EVERY_S = 1.0


def _free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Playing:
    """The processes. `place`: a folder of this run's own; what they print goes to rig.log there."""

    def __init__(self, scene_text: str, place: Path) -> None:
        self.rig = f"soak-{os.getpid()}"
        tcp, udp = socket.SOCK_STREAM, socket.SOCK_DGRAM
        self.endpoint = f"tcp/127.0.0.1:{_free_port(tcp)}"
        self.panel_port, self._osc_in, self._osc_out = _free_port(tcp), _free_port(udp), _free_port(udp)
        self.recording = place / "soak.mcap"
        self._scene_file = place / "scene.toml"
        self._scene_file.write_text(scene_text, encoding="utf-8")
        table = table_of(parse(scene_text, str(self._scene_file)))
        self._parameter = next(name for name in _MOVED if name in table)
        self._environment = dict(os.environ, XDG_STATE_HOME=str(place / "state"))
        self._log: IO[bytes] = (place / "rig.log").open("wb")
        self._up: subprocess.Popen[bytes] | None = None
        self._companions: dict[str, subprocess.Popen[bytes]] = {}

    def start(self) -> None:
        """Start the rig; it is not ready yet."""
        self._up = self._started(
            *_DRUMSTICK, "up", "--rig", self.rig, "--scene", str(self._scene_file), "--fresh",
            "--listen", self.endpoint, "--osc-in", str(self._osc_in), "--osc-out", f"127.0.0.1:{self._osc_out}",
            "--panel-port", str(self.panel_port), "--audio", "null", "--record", str(self.recording),
        )  # fmt: skip

    def accompany(self, hurry_s: float) -> None:
        """Start the companions; visits follow each other without pauses for `hurry_s`."""
        for what in (companion.OSC, companion.ZENOH, companion.VISITOR):
            self._companions[what] = self._started(
                sys.executable, "-m", "drumstick_lab.soak.processes.companion", what, "--rig", self.rig, "--connect", self.endpoint,
                "--osc-in", str(self._osc_in), "--osc-out", str(self._osc_out), "--panel-port", str(self.panel_port),
                "--token-file", str(run_folder(self.rig) / "panel-token"), "--parameter", self._parameter,
                "--pause", str(_VISIT_EVERY_S), "--hurry", str(hurry_s),
            )  # fmt: skip

    def _started(self, *command: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._log,
            env=self._environment,
            start_new_session=True,
        )

    def ended(self) -> str | None:
        """Process that ended by itself; None while all run."""
        all_of_them = {"drumstick up": self._up, **self._companions}
        for name, process in all_of_them.items():
            if process is not None and process.poll() is not None:
                return f"{name} ended with status {process.returncode}"
        return None

    def services(self) -> dict[str, int]:
        """Service -> process id: the supervisor, its children by their modules, the companions."""
        if self._up is None:
            return {}
        found = {"supervisor": self._up.pid}
        for pid in usage.children(self._up.pid):
            if module := usage.module_of(pid):
                found[module.rpartition(".")[2]] = pid
        return {**found, **{f"{name} companion": p.pid for name, p in self._companions.items()}}

    def usages(self) -> dict[str, usage.Usage]:
        """Service -> what it uses now, with its own children."""
        pids = self.services()
        found: dict[str, usage.Usage] = {}
        for name, pid in pids.items():
            apart = [p for p in pids.values() if p != pid] if name == "supervisor" else ()
            if (used := usage.service_usage(pid, apart)) is not None:
                found[name] = used
        return found

    def stop(self) -> dict[str, dict[str, Any]]:
        """Stop everything, companions first; what each of these counted."""
        reports = {name: _stopped(process) for name, process in self._companions.items()}
        if self._up is not None:
            _stopped(self._up)
        self._log.close()
        shutil.rmtree(run_folder(self.rig), ignore_errors=True)
        return reports


def _stopped(process: subprocess.Popen[bytes]) -> dict[str, Any]:
    if process.poll() is None:
        process.send_signal(signal.SIGTERM)
    try:
        out, _ = process.communicate(timeout=_STOP_WITHIN_S)
    except subprocess.TimeoutExpired:
        process.kill()
        out, _ = process.communicate()
    lines = out.decode("utf-8", "replace").splitlines()
    return _counts(lines)


def _counts(lines: Sequence[str]) -> dict[str, Any]:
    for line in reversed(lines):
        if line.startswith("{"):
            return json.loads(line)
    return {}


def wait_s(until: float) -> None:
    """Sleep until this monotonic instant, s."""
    if (left := until - time.monotonic()) > 0.0:
        time.sleep(left)
