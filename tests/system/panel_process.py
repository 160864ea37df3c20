"""A real panel as a child of the test, against whatever rig the test provides."""

import re
import signal
import subprocess
import threading
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from rig_process import PATIENCE_S

from realtime.service_options import command
from web_panel.options import PanelOptions


@dataclass
class PanelProcess:
    """`address` and `stage`, of its page for a second screen, are what it printed; `port` and `token` are taken from
    the first."""

    process: subprocess.Popen[str]
    lines: SimpleQueue[str]
    address: str
    stage: str

    @property
    def port(self) -> int:
        return int(re.findall(r":(\d+)/", self.address)[0])

    @property
    def token(self) -> str:
        return self.address.partition("token=")[2]

    @property
    def cookie(self) -> str:
        return f"drumstick_panel_{self.port}={self.token}"

    def further_lines(self) -> list[str]:
        """Output after the addresses; complete once the process has ended."""
        found: list[str] = []
        while True:
            try:
                found.append(self.lines.get_nowait())
            except Empty:
                return found

    def stop(self, by: signal.Signals = signal.SIGTERM) -> int:
        """Ask it to end; its exit status. It is killed, and the test fails, when that takes too long."""
        self.process.send_signal(by)
        try:
            return self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError("the panel did not end when told to") from None


def arguments(endpoint: str, port: int, token_file: Path, rig: str = "main", **more: Any) -> list[str]:
    options = PanelOptions(rig=rig, connect=endpoint, port=port, token_file=token_file, **more)
    return command("web_panel", options)


@contextmanager
def panel(
    endpoint: str, port: int, token_file: Path, rig: str = "main", **more: Any
) -> Generator[PanelProcess]:
    """The panel, ready, with `more` arguments; stopped at the end unless the test did so."""
    process = subprocess.Popen(
        arguments(endpoint, port, token_file, rig, **more),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    lines: SimpleQueue[str] = SimpleQueue()
    output = process.stdout
    reader = threading.Thread(target=lambda: [lines.put(line.rstrip("\n")) for line in output], daemon=True)
    reader.start()
    try:
        first = lines.get(timeout=PATIENCE_S)
        found = re.fullmatch(r"panel: (http://127\.0\.0\.1:\d+/\?token=\S+)", first)
        assert found, first
        second = lines.get(timeout=PATIENCE_S)
        stage = re.fullmatch(
            r"panel: for a second screen: (http://127\.0\.0\.1:\d+/stage\?token=\S+)", second
        )
        assert stage, second
        running = PanelProcess(process, lines, found[1], stage[1])
        yield running
        ended = process.poll()
        by_itself = ended not in (None, 0, -signal.SIGKILL, -signal.SIGTERM)
        assert not by_itself, f"the panel ended by itself, status {ended}: {running.further_lines()}"
    finally:
        if process.poll() is None:
            process.terminate()
            try:
                process.wait(PATIENCE_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        reader.join(5.0)
        output.close()
