"""A real `drumstick record`, and what it recorded."""

import signal
import subprocess
from pathlib import Path

from rig_process import DRUMSTICK, PATIENCE_S, Rig, wait_for

from protocol.messages import decode
from rig.recording import channels
from rig.recording.reading import read


class Recorder:
    """A real `drumstick record` of that rig, on its way."""

    def __init__(self, rig: Rig, out: Path, *options: str) -> None:
        where = ["--rig", rig.name, "--connect", rig.endpoint, "--out", str(out)]
        self.out = out
        self.process = subprocess.Popen(
            [*DRUMSTICK, "record", *where, *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def recorded(self, size: int = 1) -> int:
        """The file's size, when it is at least that."""
        wait_for(
            f"{size} bytes of {self.out.name}",
            lambda: (
                self.process.poll() is not None or (self.out.exists() and self.out.stat().st_size >= size)
            ),
        )
        assert self.process.poll() is None, self.process.communicate()
        return self.out.stat().st_size

    def ended(self, number: signal.Signals | None = None) -> tuple[int, str, str]:
        """Exit status, stdout, stderr; after a signal, if one is given."""
        if number is not None:
            self.process.send_signal(number)
        try:
            told, said = self.process.communicate(timeout=PATIENCE_S)
        finally:
            if self.process.poll() is None:
                self.process.kill()
        return self.process.returncode, told, said


def events(path: Path, channel: channels.Channel) -> list[object]:
    return [decode(event.payload, channel.kind) for event in read(path).of(channel)]
