"""Ends links of sessions that went beyond a limit, and turns their like back for a minute.

A client of Zenoh whose link ends comes back at once and declares everything again: ended again and again, it would hold
up strikes as much as before.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING

from haptic_server.access.sockets import plain, shut_down
from protocol.endpoint import host_and_port, is_tls
from protocol.foreign_text import shown

if TYPE_CHECKING:
    import zenoh

TURNED_BACK_S = 60.0
_MAX_ENDED = 256


class Ended:
    """Sessions ended in the last minute, by certificate and address. One thread; bounded, the oldest is forgotten."""

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._until_s: dict[tuple[str, str], float] = {}

    def note(self, certificate: str, host: str) -> None:
        """Note that its session was ended now."""
        self._until_s.pop((certificate, host), None)
        if len(self._until_s) >= _MAX_ENDED:
            del self._until_s[next(iter(self._until_s))]
        self._until_s[certificate, host] = self._now() + TURNED_BACK_S

    def holds(self, certificate: str, host: str) -> bool:
        """True when its connections are still refused."""
        return self._now() < self._until_s.get((certificate, host), 0.0)


class Disconnector:
    """On a thread of its own: whoever reads Zenoh's log must not wait for Zenoh, which waits for him."""

    def __init__(self, session: zenoh.Session) -> None:
        self.turned_back: Counter[str] = (
            Counter()
        )  # by certificate; written by the disconnector's thread alone
        self._session = session
        self._ended = Ended()
        self._due: queue.SimpleQueue[str | zenoh.Link] = queue.SimpleQueue()
        threading.Thread(target=self._run, name="disconnector", daemon=True).start()
        self._events = session.info.declare_link_events_listener(self._take_event)

    def cut(self, who: str) -> None:
        """End the links of this session, soon. Any thread; never waits."""
        self._due.put(who)

    def close(self) -> None:
        """Look at links no more."""
        self._events.undeclare()

    def _take_event(self, event: zenoh.LinkEvent) -> None:
        import zenoh

        if event.kind == zenoh.SampleKind.PUT and is_tls(str(event.link.src)):
            self._due.put(event.link)

    def _run(self) -> None:
        while True:
            due = self._due.get()
            if isinstance(due, str):
                for link in self._session.info.links():
                    if str(link.zid) == due:
                        self._end(link)
            else:
                self._judge(due)

    def _end(self, link: zenoh.Link) -> None:
        host, port = host_and_port(str(link.dst))
        self._ended.note(link.auth_identifier or "", plain(host))
        shut_down(host, port)

    def _judge(self, link: zenoh.Link) -> None:
        host, port = host_and_port(str(link.dst))
        certificate = link.auth_identifier or ""
        if self._ended.holds(certificate, plain(host)) and shut_down(host, port):
            self.turned_back[shown(certificate)] += 1
