"""A stop request that a signal handler may make.

`threading.Event.set` may not be called from one: a second signal that arrives inside it waits for ever for the lock
that the first one holds. A plain attribute has no lock.
"""

import time

_LOOK_S = 0.02


class StopRequest:
    """Set by signal handlers (any number of times), looked at by any thread."""

    def __init__(self) -> None:
        self._asked = False

    def ask(self, *_: object) -> None:
        """Ask to stop; fits `signal.signal` as it is."""
        self._asked = True

    def is_set(self) -> bool:
        """Whether somebody asked."""
        return self._asked

    def wait(self, seconds: float) -> bool:
        """Wait until asked, for at most `seconds`; whether it was asked. Looks every 20 ms."""
        end = time.monotonic() + seconds
        while not self._asked and (left := end - time.monotonic()) > 0.0:
            time.sleep(min(left, _LOOK_S))
        return self._asked
