"""A JACK server with the dummy driver: a real-time audio device without a sound card."""

import os
import shutil
import subprocess
import sys
import time
import traceback
import uuid
from collections.abc import Iterator
from contextlib import contextmanager

RATE_HZ = 48_000
_PATIENCE_S = 10.0


@contextmanager
def dummy_device(block: int, priority: int = 0) -> Iterator[str]:
    """The words by which to open the device; this process's PortAudio must not have been loaded before.

    priority: of the callback's thread (SCHED_FIFO), 0 for an ordinary one. Exits with a line where JACK is missing.
    """
    if shutil.which("jackd") is None:
        sys.exit("missing: jackd. To have it, type:\n  sudo apt-get install jackd2")
    assert "sounddevice" not in sys.modules, "PortAudio looks for JACK only when it is loaded"
    name = f"bench-{uuid.uuid4().hex[:8]}"
    os.environ |= {"JACK_DEFAULT_SERVER": name, "JACK_NO_AUDIO_RESERVATION": "1", "JACK_NO_START_SERVER": "1"}
    mode = ["-R", "-P", str(priority), "-t", "5000"] if priority else ["-r"]
    server = subprocess.Popen(
        ["jackd", "-n", name, *mode, "-d", "dummy", "-r", str(RATE_HZ), "-p", str(block)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        _wait_for(server)
        yield "(JACK Audio Connection Kit)"
    except BaseException:  # noqa: BLE001  the process ends here
        # A client that the server has given up waits for it for ever, at the interpreter's end too.
        traceback.print_exc()
        _end(server)
        os._exit(1)
    # PortAudio is a client of the server until it ends, and asserts that the server is still there then.
    if portaudio := sys.modules.get("sounddevice"):
        portaudio._terminate()
    _end(server)


def _end(server: subprocess.Popen[bytes]) -> None:
    # Never killed: JACK's registry has room for eight servers, and only one that ends by itself leaves it.
    server.terminate()
    server.wait(20.0)


def _wait_for(server: subprocess.Popen[bytes]) -> None:
    look = "import sounddevice; print([api['name'] for api in sounddevice.query_hostapis()])"
    end = time.monotonic() + _PATIENCE_S
    while time.monotonic() < end:
        assert server.poll() is None, "jackd ended at once"
        seen = subprocess.run([sys.executable, "-c", look], capture_output=True, text=True, check=False)
        if "JACK" in seen.stdout:
            return
        time.sleep(0.1)
    raise TimeoutError("no JACK server in ten seconds")
