"""Watching a running rig over Zenoh: state, meters. Never waits: the supervisor calls `look` a few times a second."""

from __future__ import annotations

import time
from typing import Any

from protocol.keys import Keys
from protocol.messages import Meter, State, decode
from protocol.session import client_config
from rig.ports import listens

_PROTOCOLS = ("tcp", "tls")


class Watch:
    """A Zenoh client that opens when the router is there."""

    def __init__(self, endpoint: str, keys: Keys) -> None:
        self._endpoint = endpoint
        self._keys = keys
        self._session: Any = None
        self._subscribers: list[Any] = []
        self.state: State | None = None
        self.unreadable = 0
        self.highest_rate_Hz = 0.0
        self._meters: dict[str, Meter] = {}
        self._heard_meter_at = 0.0
        self._strikes: dict[int, int] = {}
        self._overruns: dict[int, int] = {}
        self._worst_us = 0.0

    def look(self) -> None:
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
            self._meters[message.id] = message
            self._heard_meter_at = time.monotonic()
            return
        self.state = message
        self._strikes[message.boot] = message.strikes
        self._overruns[message.boot] = message.overruns
        self._worst_us = max(self._worst_us, message.lateness_worst_us)

    def _open(self) -> None:
        host, port = host_and_port(self._endpoint)
        if not listens(host, port):
            return
        import zenoh

        try:
            self._session = zenoh.open(client_config(self._endpoint))
        except zenoh.ZError:
            return  # the router went away again: the next look tries once more
        self._subscribers = [
            (self._session.declare_subscriber(self._keys.state, zenoh.handlers.RingChannel(64)), State),
            (self._session.declare_subscriber(self._keys.meter, zenoh.handlers.RingChannel(64)), Meter),
        ]

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
        if self._session is not None:
            self._session.close()
            self._session = None


def host_and_port(endpoint: str) -> tuple[str, int]:
    """127.0.0.1, 7447 of tcp/127.0.0.1:7447; ValueError for anything else."""
    protocol, _, address = endpoint.partition("/")
    host, _, port = address.rpartition(":")
    if protocol not in _PROTOCOLS or not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise ValueError(f"{endpoint!r} is not a Zenoh endpoint like tcp/127.0.0.1:7447")
    return host.removeprefix("[").removesuffix("]"), int(port)
