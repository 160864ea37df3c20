"""A stop request that a signal handler may make.

`threading.Event.set` may not be called from one: a second signal that arrives inside it waits for ever for the lock
that the first one holds. A plain attribute has no lock.
"""

import signal
import time
from collections.abc import Callable

_POLL_S = 0.02


class StopRequest:
    """Set by signal handlers (any number of times), looked at by any thread."""

    def __init__(self) -> None:
        self._asked = False

    def ask(self, *_: object) -> None:
        """Ask to stop; fits `signal.signal` as it is."""
        self._asked = True

    def is_set(self) -> bool:
        """True when somebody asked."""
        return self._asked

    def wait(self, seconds: float) -> bool:
        """Wait until asked, for at most `seconds`; whether it was asked. Looks every 20 ms."""
        end = time.monotonic() + seconds
        while not self._asked and (left := end - time.monotonic()) > 0.0:
            time.sleep(min(left, _POLL_S))
        return self._asked


def on_stop_signals(ask: Callable[..., None]) -> None:
    """Call `ask` at SIGINT, SIGTERM and SIGHUP; the last one only where the caller did not ignore it, as nohup does.

    The main thread.
    """
    signal.signal(signal.SIGINT, ask)
    signal.signal(signal.SIGTERM, ask)
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        signal.signal(signal.SIGHUP, ask)
