"""Discovery of the rigs that patterns stand for, as their haptic servers' tokens come and go."""

import time
from collections import defaultdict
from collections.abc import Callable, Sequence

import zenoh

from protocol.pattern import alive_key, presence_of

_RING = 1024
_MAX_HEARD = 1000  # names; anybody who may declare tokens could make up any number
LET_GO_S = 10.0


class Presences:
    """Rigs by the tokens seen so far. One thread; `clock` returns seconds that only grow."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._servers: defaultdict[str, set[str]] = defaultdict(set)
        self._gone_at: dict[str, float] = {}

    def note(self, key: str, here: bool) -> None:
        """A token came, or went. What is no haptic server's is passed over."""
        presence = presence_of(key)
        if presence is None or presence.service != "haptic":
            return
        if here:
            if presence.rig in self._servers or len(self._servers) < _MAX_HEARD:
                self._servers[presence.rig].add(presence.instance)
                self._gone_at.pop(presence.rig, None)
            return
        servers = self._servers.get(presence.rig)
        if servers is not None:
            servers.discard(presence.instance)
            if not servers:
                self._gone_at.setdefault(presence.rig, self._clock())

    def rigs(self) -> list[str]:
        """Rigs that are there, or went less than LET_GO_S ago: a router or a gateway that starts again takes a second
        or two. In the order in which they were first seen."""
        for rig, gone_at in list(self._gone_at.items()):
            if self._clock() - gone_at >= LET_GO_S:
                del self._gone_at[rig], self._servers[rig]
        return list(self._servers)


class Discovery:
    """Looks over `session` for rigs by `patterns`. `rigs` belongs to one thread and never waits."""

    def __init__(self, session: zenoh.Session, patterns: Sequence[str]) -> None:
        self._presences = Presences()
        self._subscribers = [
            session.liveliness().declare_subscriber(
                alive_key(pattern, "haptic"), zenoh.handlers.RingChannel(_RING), history=True
            )
            for pattern in patterns
        ]

    def rigs(self) -> list[str]:
        """Take what has arrived; the names of the rigs that there are."""
        for subscriber in self._subscribers:
            while (sample := subscriber.try_recv()) is not None:
                self._presences.note(str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT)
        return self._presences.rigs()
