"""A JACK server with the dummy driver: real-time audio and MIDI without a sound card."""

import subprocess
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from rig_process import PATIENCE_S, wait_for

# A client of its own for every look: PortAudio sees a JACK server only when it starts.
LOOK = "import sounddevice; print([api['name'] for api in sounddevice.query_hostapis()])"


class Jack:
    """A JACK server under a name of its own; `environment` leads clients to it and to no other.

    One that waits gives each client the time it needs; any other goes on without it, and what it had for that block,
    such as a note, is nobody's.
    """

    def __init__(
        self, environment: dict[str, str], folder: Path, waits: bool = False, outputs: int = 2
    ) -> None:
        self._mode = ["-S"] if waits else []
        self._driver = ["-r", "48000", "-p", "128", "-P", str(outputs)]
        self.log = folder / "jackd.log"
        name = f"test-{uuid.uuid4().hex[:8]}"
        self.environment = environment | {
            "JACK_DEFAULT_SERVER": name,
            "JACK_NO_AUDIO_RESERVATION": "1",
            "JACK_NO_START_SERVER": "1",
        }
        self._name = name
        self.start()

    def start(self) -> None:
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                ["jackd", "-n", self._name, "-r", *self._mode, "-d", "dummy", *self._driver],
                stdout=log,
                stderr=subprocess.STDOUT,
                env=self.environment,
            )

    def is_up(self) -> bool:
        assert self.process.poll() is None, self.log.read_text()
        look = subprocess.run(
            [sys.executable, "-c", LOOK], capture_output=True, text=True, env=self.environment, check=False
        )
        if "PortAudio library not found" in look.stderr:
            pytest.skip("PortAudio not found: sudo apt-get install libportaudio2")
        return "JACK" in look.stdout

    def close(self) -> None:
        # Never kill it: JACK's registry has room for eight servers, and only one that ends by itself leaves it.
        self.process.terminate()
        self.process.wait(PATIENCE_S)


@contextmanager
def jack_server(
    environment: dict[str, str], folder: Path, waits: bool = False, outputs: int = 2
) -> Iterator[Jack]:
    """A `Jack` that is up."""
    started = Jack(environment, folder, waits, outputs)
    try:
        wait_for("JACK", started.is_up)
        yield started
    finally:
        started.close()
