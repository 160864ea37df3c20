"""Who was told a value of late: a rig that hears it back from there need not answer, or two rigs would for ever.

An answer to a set looks like a set: what one rig answers, another one hears as a wish.
"""

import threading
from collections.abc import Iterable
from typing import NamedTuple

from haptic_server.gateway.osc.targets import Endpoint
from haptic_server.gateway.rounding import is_same

MEMORY_S = 2.0
ANSWERS = 3  # to one sender, of one value, within that time: somebody who asks again after a loss gets one
MOST_TOLD = 256  # of each parameter; beyond, whoever was told longest ago is forgotten


class _Told(NamedTuple):
    value: float
    until_s: float
    answers_left: int


class Told:
    """Any thread; held locks are short."""

    def __init__(self) -> None:
        self._told: dict[str, dict[Endpoint, _Told]] = {}
        self._lock = threading.Lock()

    def note(self, name: str, value: float, endpoints: Iterable[Endpoint], now_s: float) -> None:
        """They are told without having asked: for a while they need no answer."""
        with self._lock:
            for endpoint in endpoints:
                self._keep(name, endpoint, _Told(value, now_s + MEMORY_S, 0))

    def spend(self, name: str, value: float, sender: Endpoint, now_s: float) -> bool:
        """Whether to answer the sender of a set that changes nothing: `value` is what holds."""
        with self._lock:
            known = self._told.get(name, {}).get(sender)
            if known is None or known.until_s <= now_s or not is_same(known.value, value):
                known = _Told(value, now_s + MEMORY_S, ANSWERS)
            if known.answers_left == 0:
                return False
            self._keep(name, sender, known._replace(answers_left=known.answers_left - 1))
            return True

    def _keep(self, name: str, endpoint: Endpoint, told: _Told) -> None:
        known = self._told.setdefault(name, {})
        known.pop(endpoint, None)
        if len(known) >= MOST_TOLD:
            del known[next(iter(known))]
        known[endpoint] = told
