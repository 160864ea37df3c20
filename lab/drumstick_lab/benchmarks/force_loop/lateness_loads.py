"""Loads beside the loops of lateness.py: busy processes, a real gateway, floods. Each ends what it started."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zenoh
from rig_process import free_port

from haptic_server.gateway.options import GatewayOptions
from protocol.keys import Keys
from protocol.session import client_config
from realtime.service_options import command


@contextmanager
def busy_processes(count: int) -> Iterator[None]:
    """So many processes of ordinary priority that never rest."""
    spin = [sys.executable, "-c", "while True: pass"]
    started = [subprocess.Popen(spin) for _ in range(count)]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


class Gateway:
    """The real gateway of a servo's run folder, as `drumstick haptic` starts it, on ports of its own."""

    def __init__(self, run_dir: Path) -> None:
        self.rig = f"lateness-{os.getpid()}"
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.osc_port, out = free_port(), free_port()
        options = GatewayOptions(
            run_dir=run_dir, state_dir=run_dir / "state", rig=self.rig, listen=self.endpoint,
            osc_in=("127.0.0.1", self.osc_port), osc_out=(("127.0.0.1", out),),
        )  # fmt: skip
        started = command("haptic_server.gateway", options)
        self._process = subprocess.Popen(started, stderr=subprocess.DEVNULL)

    def _asked(self, key: str) -> bytes | None:
        # Every answer needs a session of its own: none of the benchmark's may run beside the loops.
        try:
            with zenoh.open(client_config(self.endpoint)) as session:
                for reply in session.get(key, timeout=5.0):
                    if reply.ok is not None:
                        return reply.ok.payload.to_bytes()
        except zenoh.ZError:
            return None
        return None

    def answers(self) -> bool:
        """True when it is there; waits half a second for it."""
        return self._asked(Keys(self.rig).clock) is not None

    def counters(self) -> dict[str, int]:
        """Counts of its OSC side so far."""
        report = self._asked(Keys(self.rig).doctor)
        return json.loads(report)["osc"] if report else {}

    def close(self) -> None:
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(20.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class Flood:
    """A process of lateness_flood.py."""

    def __init__(self, *given: str) -> None:
        command = [sys.executable, "-m", "drumstick_lab.benchmarks.force_loop.lateness_flood", *given]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        time.sleep(2.0)  # its imports are no part of the flood

    def close(self) -> None:
        """End it, however it stands."""
        self._process.kill()
        self._process.communicate(timeout=30)

    def end(self) -> dict[str, Any]:
        """Ask it to stop; what it says it sent."""
        self._process.send_signal(signal.SIGTERM)
        said, _ = self._process.communicate(timeout=30)
        assert self._process.returncode == 0
        return json.loads(said)
