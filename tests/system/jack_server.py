"""A JACK server with the dummy driver: real-time audio and MIDI without a sound card."""

import fcntl
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import IO

import pytest

# A client of its own for every look: PortAudio sees a JACK server only when it starts.
LOOK = "import sounddevice; print([api['name'] for api in sounddevice.query_hostapis()])"


# JACK's registry has room for eight servers on a machine, and one that was killed keeps its place until another comes
# under the same name: with a new name for each, the suite's own were once the ninth.
SLOTS = 6


def _own_slot() -> tuple[int, IO[bytes]]:
    for slot in range(SLOTS):
        lock = (Path(tempfile.gettempdir()) / f"drumstick-test-jack-{os.getuid()}-{slot}").open("ab")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            lock.close()
            continue
        return slot, lock
    raise AssertionError(f"{SLOTS} other tests have a JACK server now: wait until they have ended")


class Jack:
    """A JACK server under a name of its own; `environment` leads clients to it and to no other."""

    def __init__(self, environment: dict[str, str], folder: Path) -> None:
        self.log = folder / "jackd.log"
        slot, self._lock = _own_slot()
        name = f"drumstick-test-{slot}"
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
                ["jackd", "-n", self._name, "-r", "-d", "dummy", "-r", "48000", "-p", "128"],
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
        # Never kill it: only one that ends by itself leaves the registry.
        self.process.terminate()
        self.process.wait(20.0)
        self._lock.close()
