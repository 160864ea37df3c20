"""Watching a running rig over Zenoh: state, meters. Never waits: the supervisor calls `look` a few times a second."""

from __future__ import annotations

import threading
import time
from typing import Any

from protocol.access.identity import Identity
from protocol.endpoint import host_and_port, is_tls
from protocol.keys import Keys
from protocol.messages import Meter, State, decode
from protocol.session import client_config, open_client
from rig.network.ports import listens

_MAX_METERS = 100  # sound servers, each start of one too


class Watch:
    """A Zenoh client that opens when the router is there."""

    def __init__(self, endpoint: str, keys: Keys, identity: Identity | None = None) -> None:
        self._endpoint = endpoint
        self._identity = identity
        self._keys = keys
        self._session: Any = None
        self._opening: threading.Thread | None = None
        self._closing = threading.Event()
        self._subscribers: list[Any] = []
        self.state: State | None = None
        self.unreadable = 0
        self.highest_rate_Hz = 0.0
        self._meters: dict[str, Meter] = {}
        self._heard_meter_at = 0.0
        self._strikes: dict[int, int] = {}
        self._overruns: dict[int, int] = {}
        self._worst_us = 0.0

    def poll(self) -> None:
        """Take what has arrived; the newest state and every sound server's newest meter count."""
        if self._session is None:
            self._open()
            return
        for subscriber, kind in self._subscribers:
            while (sample := subscriber.try_recv()) is not None:
                try:
                    message = decode(sample.payload.to_bytes(), kind)
                except ValueError:
                    self.unreadable += 1  # anybody on the network can put there: it must not stop the rig
                    continue
                self._take(message)

    def _take(self, message: State | Meter) -> None:
        if isinstance(message, Meter):
            if message.id not in self._meters and len(self._meters) >= _MAX_METERS:
                del self._meters[next(iter(self._meters))]
            self._meters[message.id] = message
            self._heard_meter_at = time.monotonic()
            return
        self.state = message
        self._strikes[message.boot] = message.strikes
        self._overruns[message.boot] = message.overruns
        self._worst_us = max(self._worst_us, message.lateness_worst_us)

    def _open(self) -> None:
        if is_tls(self._endpoint):
            # Not tried like a loopback port: each connection that is no handshake holds others up for 0.1 s.
            if self._opening is None:
                self._opening = threading.Thread(target=self._open_over_tls, name="watch", daemon=True)
                self._opening.start()
            return
        if not listens(*host_and_port(self._endpoint)):
            return
        import zenoh

        try:
            self._subscribe(zenoh.open(client_config(self._endpoint)))
        except zenoh.ZError:
            return  # the router went away again: the next look tries once more

    def _open_over_tls(self) -> None:
        # A thread of its own, because it waits; the services themselves say why they are refused.
        session = open_client(
            self._endpoint, lambda: not self._closing.is_set(), self._identity, report=lambda _: None
        )
        if session is not None:
            self._subscribe(session)

    def _subscribe(self, session: Any) -> None:
        import zenoh

        self._subscribers = [
            (session.declare_subscriber(self._keys.state, zenoh.handlers.RingChannel(64)), State),
            (session.declare_subscriber(self._keys.meter, zenoh.handlers.RingChannel(64)), Meter),
        ]
        self._session = session

    @property
    def meter(self) -> Meter | None:
        """The newest meter of the newest sound server."""
        return next(reversed(self._meters.values()), None)

    @property
    def strikes(self) -> int:
        """Strikes of every servo start seen."""
        return sum(self._strikes.values())

    @property
    def overruns(self) -> int:
        """Overruns of every servo start seen."""
        return sum(self._overruns.values())

    @property
    def worst_lateness_us(self) -> float:
        """The latest tick seen."""
        return self._worst_us

    @property
    def xruns(self) -> int:
        """Xruns of every sound server seen."""
        return sum(m.xruns for m in self._meters.values())

    def close(self) -> None:
        """Leave; without it the process would not end."""
        self._closing.set()
        if self._opening is not None:
            self._opening.join()
        if self._session is not None:
            self._session.close()
            self._session = None
