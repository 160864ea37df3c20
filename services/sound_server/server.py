"""The sound server: keeps a sink playing the drums of the rigs that it was given, struck over the network.

The main thread only watches: each rig's drum has a thread, strikes come on Link's threads, sound is made on the
sink's.
"""

import os
import secrets
import threading
import time
from collections.abc import Sequence

from protocol.identity import Identity
from protocol.keys import Keys
from protocol.session import open_client
from realtime.notify import Supervisor
from realtime.stop import StopRequest
from sound_server.complaints import Complaints
from sound_server.drum import Drum
from sound_server.link import Link
from sound_server.sinks.sink import Sink

_TURN_S = 0.1


class DeviceLost(Exception):
    """The audio device went away. Its driver may hang when closed, so the process starts anew without trying."""


class Server:
    """`run` returns when `stop` is set; the sink stays open. Each of `rigs` has a drum of its own."""

    def __init__(
        self,
        rigs: Sequence[str],
        router: str,
        sink: Sink,
        stop: StopRequest,
        identity: Identity | None = None,
        supervisor: Supervisor | None = None,
    ) -> None:
        self._rigs = rigs
        self._router = router
        self._sink = sink
        self._stop = stop
        self._identity = identity
        self._supervisor = supervisor
        self._turns = 0

    def run(self) -> None:
        """Serve until stopped. Raises DeviceLost."""
        session = open_client(self._router, self._may_wait, self._identity)
        if session is None:
            self._check_device()
            return
        ident = f"{os.getpid():x}-{secrets.token_hex(3)}"
        complaints = Complaints(time.monotonic_ns)
        links = [Link(session, Keys(rig), complaints) for rig in self._rigs]
        drums = [Drum(link, self._sink, ident, complaints, self._stop) for link in links]
        threads = [threading.Thread(target=drum.run, name="drum", daemon=True) for drum in drums]
        for thread in threads:
            thread.start()
        try:
            while not self._stop.wait(_TURN_S):
                self._check_device()
                self._tell("")
                if not all(thread.is_alive() for thread in threads):
                    raise RuntimeError("a drum's thread ended; its traceback stands above")
            for thread in threads:
                thread.join()
        finally:
            session.close()
            for link in links:
                link.close()

    def _may_wait(self) -> bool:
        self._tell(f"waiting for the router {self._router}; ")
        return not self._stop.is_set() and not self._sink.lost

    def _tell(self, first: str) -> None:
        # A supervisor hears of us while sound is made, not only while this thread lives.
        turns, sink = self._sink.turns, self._sink
        if self._supervisor is not None and turns != self._turns:
            self._turns = turns
            self._supervisor.turned(f"{first}{sink.words}, load {sink.load:.0%}, {sink.xruns} xruns")

    def _check_device(self) -> None:
        if self._sink.lost:
            raise DeviceLost(f"{self._sink.words}: {self._sink.lost}")
