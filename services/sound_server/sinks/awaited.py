"""A device that went away: the process starts anew without it, plays on for nobody, and looks for it for ever.

PortAudio lists devices once, and a stream whose JACK server was killed does not close, so neither looking again nor
closing can be done in place. A new process image has neither trouble; a look is a process of its own, which may hang.
"""

import logging
import subprocess
import sys
import threading
from collections.abc import Callable

from realtime.stop import StopRequest
from sound_server.sinks.choose import labels
from sound_server.sinks.paced import PacedSink
from sound_server.sinks.sink import SinkError

_FIRST_LOOK_S, _LONGEST_LOOK_S = 1.0, 10.0
_HANGS_S = 20.0


def is_there(name: str) -> bool:
    """Whether an audio output of this name is there now; asked of a process that is new to the devices."""
    try:
        found = subprocess.run(
            [sys.executable, "-m", "sound_server.sinks.awaited"],
            capture_output=True,
            text=True,
            timeout=_HANGS_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return False
    return any(name.lower() in line.lower() for line in found.stdout.splitlines())


class Lookout:
    """Looks for the device on a thread of its own, and asks the process to stop once it is `found`."""

    def __init__(self, name: str, stop: StopRequest, look: Callable[[str], bool] = is_there) -> None:
        self.found = False
        self._name = name
        self._stop = stop
        self._look = look
        threading.Thread(target=self._run, name="lookout", daemon=True).start()

    def _run(self) -> None:
        pause_s = _FIRST_LOOK_S
        while not self._stop.wait(pause_s):
            if self._look(self._name):
                logging.info("%s is back", self._name)
                self.found = True
                self._stop.ask()
            pause_s = min(2.0 * pause_s, _LONGEST_LOOK_S)


def stand_in(name: str, rate_Hz: int, block: int) -> PacedSink:
    """What plays meanwhile: in time, for nobody. Its words tell every meter what is awaited."""
    logging.warning("%s is away; playing for nobody until it comes back", name)
    return PacedSink(f"waiting for {name}", rate_Hz, block)


if __name__ == "__main__":
    try:
        print("\n".join(labels()))
    except SinkError:
        sys.exit(3)
