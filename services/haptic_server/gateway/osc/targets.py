"""Destinations of outgoing OSC: targets given at the start, and ports that subscribed for a minute."""

import threading
from collections.abc import Sequence

Endpoint = tuple[str, int]  # numeric IPv4 address, UDP port

SUBSCRIPTION_S = 60.0
MAX_SUBSCRIPTIONS = 64
MAX_OF_A_HOST = 16  # so that no host alone can keep the others out


class Targets:
    """Any thread; held locks are short."""

    def __init__(self, fixed: Sequence[Endpoint]) -> None:
        self._fixed = dict.fromkeys(fixed)
        self._until: dict[Endpoint, float] = {}
        self._lock = threading.Lock()

    def add(self, endpoint: Endpoint) -> None:
        """One more for good."""
        with self._lock:
            self._fixed[endpoint] = None

    def subscribe(self, endpoint: Endpoint, now_s: float) -> str:
        """Begin or renew a subscription; otherwise why there is no room for it."""
        with self._lock:
            if endpoint in self._fixed:
                return ""
            self._expire(now_s)
            if endpoint not in self._until:
                if sum(host == endpoint[0] for host, _ in self._until) >= MAX_OF_A_HOST:
                    return f"{MAX_OF_A_HOST} ports of {endpoint[0]} have subscribed"
                if len(self._until) >= MAX_SUBSCRIPTIONS:
                    return f"{MAX_SUBSCRIPTIONS} ports have subscribed"
            self._until[endpoint] = now_s + SUBSCRIPTION_S
            return ""

    def unsubscribe(self, host: str, port: int | None) -> None:
        """End one subscription of a host, or (None) all of them; what is not subscribed is no mistake."""
        with self._lock:
            for endpoint in [e for e in self._until if e[0] == host and port in (None, e[1])]:
                del self._until[endpoint]

    def present(self, now_s: float) -> list[Endpoint]:
        """Every target, each once."""
        with self._lock:
            self._expire(now_s)
            return [*self._fixed, *self._until]

    def _expire(self, now_s: float) -> None:
        for endpoint in [e for e, until in self._until.items() if until <= now_s]:
            del self._until[endpoint]
