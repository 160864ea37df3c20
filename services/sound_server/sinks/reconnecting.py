"""A device that is not there, or went away: the process plays on for nobody, looks for it for ever, and starts anew.

PortAudio lists devices once, and a stream whose JACK server was killed does not close, so neither looking again nor
closing can be done in place. A new process image has neither trouble; a look is a process of its own, which may hang.
"""

import logging
import subprocess
import sys
import threading
from collections.abc import Callable

from realtime.stop import StopRequest
from sound_server.sinks.paced import PacedSink
from sound_server.sinks.selection import AUTO, labels
from sound_server.sinks.sink import SinkError

_FIRST_POLL_S, _MAX_POLL_S = 1.0, 10.0
_HANGS_S = 20.0


def is_there(name: str) -> bool:
    """True when an audio output of this name (any, for auto) is there now; asked of a process new to the devices."""
    try:
        found = subprocess.run(
            [sys.executable, "-m", "sound_server.sinks.reconnecting"],
            capture_output=True,
            text=True,
            timeout=_HANGS_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    there = found.stdout.splitlines()
    return bool(there) if name == AUTO else any(name.lower() in line.lower() for line in there)


class DeviceWatch:
    """Looks for the device on a thread of its own, and asks the process to stop once it is `found`."""

    def __init__(self, name: str, stop: StopRequest, look: Callable[[str], bool] = is_there) -> None:
        self.found = False
        self._name = name
        self._stop = stop
        self._poll = look
        threading.Thread(target=self._run, name="device_watch", daemon=True).start()

    def _run(self) -> None:
        pause_s = _FIRST_POLL_S
        while not self._stop.wait(pause_s):
            if self._poll(self._name):
                logging.info("%s is there", _called(self._name))
                self.found = True
                self._stop.ask()
            pause_s = min(2.0 * pause_s, _MAX_POLL_S)


def placeholder_sink(name: str, why: Exception, rate_Hz: int, block: int, channels: int = 2) -> PacedSink:
    """Sink that plays in time for nobody while a device is awaited; its description tells every meter which."""
    logging.warning("%s; no audio until %s is available", why, _called(name))
    return PacedSink(f"waiting for {_called(name)}", rate_Hz, block, channels=channels)


def _called(name: str) -> str:
    return "an audio device" if name == AUTO else name


if __name__ == "__main__":
    try:
        print("\n".join(labels()))
    except SinkError:
        sys.exit(3)
