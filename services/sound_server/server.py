"""The sound server: keeps a sink playing the drums of the rigs that it was given, struck over the network.

The main thread only watches: each rig has a Zenoh session and a thread, strikes come on Link's threads, sound is made
on the sink's. Rigs that a pattern stands for come and go while the others play.
"""

import logging
import os
import secrets
import threading
import time
from collections.abc import Callable, Sequence

import zenoh

from protocol.access.identity import Identity
from protocol.keys import Keys
from protocol.pattern import is_pattern
from protocol.rate_limited_log import RateLimitedLog
from protocol.session import open_client
from realtime.notify import Supervisor
from realtime.stop import StopRequest
from sound_server.drum import Drum
from sound_server.output_trim import OutputTrim
from sound_server.outputs import of_rig
from sound_server.ranges import MAX_RIGS
from sound_server.receiving.discovery import Discovery
from sound_server.receiving.link import Link
from sound_server.roster import Roster
from sound_server.sinks.sink import Sink

_TURN_S = 0.1
_NO_TRIM = OutputTrim()


class DeviceLost(Exception):
    """The audio device went away. Its driver may hang when closed, so the process starts anew without trying."""


class Server:
    """`run` returns when `stop` is set; the sink stays open. Each of `rigs` has a drum of its own; one with a * stands
    for all that match it, as they come and go, up to `most` drums together."""

    def __init__(
        self,
        rigs: Sequence[str],
        router: str,
        sink: Sink,
        stop: StopRequest,
        identity: Identity | None = None,
        most: int = MAX_RIGS,
        trim: OutputTrim = _NO_TRIM,
        supervisor: Supervisor | None = None,
    ) -> None:
        self._named = [rig for rig in rigs if not is_pattern(rig)]
        self._patterns = [rig for rig in rigs if is_pattern(rig)]
        self._router, self._identity = router, identity
        self._sink, self._trim, self._most = sink, trim, most
        self._stop = stop
        self._supervisor = supervisor
        self._turns = 0
        self._has_router = False  # some seat came in
        self._id = f"{os.getpid():x}-{secrets.token_hex(3)}"
        self._log_limited = RateLimitedLog(time.monotonic_ns)
        self._logged: set[str] = set()
        self._telling = threading.Lock()

    def run(self) -> None:
        """Serve until stopped. Raises DeviceLost."""
        roster = Roster(self._named, self._most, self._play)
        session: zenoh.Session | None = None
        try:
            discovery = None
            if self._patterns and (session := self._opened(self._stop, self._report)) is not None:
                discovery = Discovery(session, self._patterns)
            while not self._stop.wait(_TURN_S):
                is_broken = roster.is_broken  # asked first: a lost device ends threads too
                self._check_device()
                self._report()
                if is_broken:
                    raise RuntimeError("a drum's thread ended; its traceback stands above")
                if discovery is not None:
                    roster.follow(discovery.rigs())
            self._check_device()
        finally:
            roster.close()
            if session is not None:
                session.close()

    def _play(self, rig: str, stop: StopRequest) -> None:
        # The whole life of one rig's seat, on its thread.
        session = self._opened(stop)
        if session is None:
            return
        link = Link(session, Keys(rig), self._log_limited)
        outputs = of_rig(self._trim.outputs, rig)
        drum = Drum(link, self._sink, self._id, self._log_limited, stop, self._trim, outputs)
        try:
            drum.run()
            drum.leave(lambda: self._stop.is_set() or bool(self._sink.lost))
        finally:
            session.close()
            link.close()

    def _opened(
        self, stop: StopRequest, at_each_try: Callable[[], None] = lambda: None
    ) -> zenoh.Session | None:
        def keep_trying() -> bool:
            at_each_try()
            return not (stop.is_set() or self._stop.is_set() or self._sink.lost)

        session = open_client(self._router, keep_trying, self._identity, self._log_once)
        self._has_router = self._has_router or session is not None
        return session

    def _log_once(self, words: str) -> None:
        # Every seat is refused for the same reason.
        with self._telling:
            if words not in self._logged:
                self._logged.add(words)
                logging.getLogger("zenoh").warning(words)

    def _report(self) -> None:
        # Main thread. A supervisor hears of us while sound is made, not only while this thread lives.
        turns, sink = self._sink.turns, self._sink
        first = "" if self._has_router else f"waiting for the router {self._router}; "
        if self._supervisor is not None and turns != self._turns:
            self._turns = turns
            self._supervisor.notify_alive(
                f"{first}{sink.description}, load {sink.load:.0%}, {sink.xruns} xruns"
            )

    def _check_device(self) -> None:
        if self._sink.lost:
            raise DeviceLost(f"{self._sink.description}: {self._sink.lost}")
