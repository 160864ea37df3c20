"""Values published of late, and to whom: what comes back of them is no request, or two rigs would set for ever.

An answer to a set looks like a set: what one rig answers, another one takes for a request. And while a fader moves,
what comes back is where it was a moment ago.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import NamedTuple

from haptic_server.gateway.osc.targets import Endpoint
from haptic_server.gateway.rounding import is_same

MEMORY_S = 2.0
ECHO_S = 1.0  # an older value that comes back within that time, from others than who set it, is an echo
ANSWERS = 3  # to one sender, of one value, within that time: somebody who asks again after a loss gets one
MAX_REMEMBERED = 256  # of each parameter: endpoints, and values; beyond, the oldest is forgotten


class _Publication(NamedTuple):
    value: float
    until_s: float
    answers_left: int


class _Value(NamedTuple):
    value: float
    until_s: float
    setters: frozenset[Endpoint]


class EchoFilter:
    """Any thread; held locks are short."""

    def __init__(self) -> None:
        self._published: dict[str, dict[Endpoint, _Publication]] = {}
        self._values: dict[str, deque[_Value]] = {}
        self._lock = threading.Lock()

    def note(self, name: str, value: float, endpoints: Iterable[Endpoint], now_s: float) -> None:
        """Note a value sent to endpoints that did not ask: for a while they need no answer."""
        with self._lock:
            for endpoint in endpoints:
                self._keep(name, endpoint, _Publication(value, now_s + MEMORY_S, 0))

    def note_value(self, name: str, value: float, setters: Iterable[Endpoint], now_s: float) -> None:
        """Note a value that was published to all; `setters`: who set it, as far as they spoke OSC."""
        with self._lock:
            values = self._values.setdefault(name, deque(maxlen=MAX_REMEMBERED))
            values.append(_Value(value, now_s + ECHO_S, frozenset(setters)))

    def is_echo(self, name: str, is_it: Callable[[float], bool], sender: Endpoint, now_s: float) -> bool:
        """True when a set that differs from the present value only repeats what this rig sent the sender a moment ago.

        `is_it` recognises the value. Whoever set it himself may go back to it at any time.
        """
        with self._lock:
            same = [v for v in self._values.get(name, ()) if v.until_s > now_s and is_it(v.value)]
            return bool(same) and not any(sender in v.setters for v in same)

    def spend(self, name: str, value: float, sender: Endpoint, now_s: float) -> bool:
        """True when the sender of a set that changes nothing is to be answered: `value` is in force."""
        with self._lock:
            known = self._published.get(name, {}).get(sender)
            if known is None or known.until_s <= now_s or not is_same(known.value, value):
                known = _Publication(value, now_s + MEMORY_S, ANSWERS)
            if known.answers_left == 0:
                return False
            self._keep(name, sender, known._replace(answers_left=known.answers_left - 1))
            return True

    def _keep(self, name: str, endpoint: Endpoint, publication: _Publication) -> None:
        known = self._published.setdefault(name, {})
        known.pop(endpoint, None)
        if len(known) >= MAX_REMEMBERED:
            del known[next(iter(known))]
        known[endpoint] = publication
