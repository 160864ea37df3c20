"""Senders that are no targets and wait for the readback of what they set."""

import math
import threading
from typing import NamedTuple

from haptic_server.gateway.osc.targets import Endpoint

PATIENCE_S = 1.0
MAX_WAITING = 64


class _Wait(NamedTuple):
    value: float
    until_s: float


def _same(a: float, b: float) -> bool:
    # Clients see 32 bits; z_h0 comes back through z_ss with another last digit.
    return math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-12)


class ReplyTargets:
    """Parameter name -> who waits for which value. Any thread; held locks are short.

    While a fader moves, readbacks of older values arrive first: they go to the sender too, and the wait ends with the
    value that was set last, or after one second.
    """

    def __init__(self) -> None:
        self._waiting: dict[str, dict[Endpoint, _Wait]] = {}
        self._lock = threading.Lock()

    def expect(self, name: str, sender: Endpoint, value: float, now_s: float) -> _Wait | None:
        """Wait from now on (call it before the set: the readback may come first). Returns what it replaces."""
        with self._lock:
            waiting = self._waiting.setdefault(name, {})
            before = waiting.pop(sender, None)
            if len(waiting) >= MAX_WAITING:
                del waiting[next(iter(waiting))]
            waiting[sender] = _Wait(value, now_s + PATIENCE_S)
            return before

    def forget(self, name: str, sender: Endpoint, before: _Wait | None = None) -> None:
        """The set was refused, or is answered: wait no longer, or again for what `expect` returned."""
        with self._lock:
            waiting = self._waiting.setdefault(name, {})
            waiting.pop(sender, None)
            if before is not None:
                waiting[sender] = before

    def claim(self, name: str, value: float, now_s: float) -> list[Endpoint]:
        """Senders that get this readback besides the targets."""
        with self._lock:
            waiting = self._waiting.get(name)
            if not waiting:
                return []
            for sender in [s for s, wait in waiting.items() if wait.until_s <= now_s]:
                del waiting[sender]
            claimed = list(waiting)
            for sender in [s for s, wait in waiting.items() if _same(wait.value, value)]:
                del waiting[sender]
            return claimed
