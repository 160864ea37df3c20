"""The sound server: keeps a sink playing the drum of the rig's scene, struck over the network.

Everything here runs on the main thread, ten times a second; strikes come on Link's threads, sound is made on the
sink's.
"""

import logging
import os
import secrets
import threading
import time

from drumstick.scene import Scene
from protocol.keys import Keys
from protocol.messages import Meter, State, decode
from protocol.session import open_client
from realtime.jit import Record
from realtime.stop import StopRequest
from sound_server.build import words
from sound_server.calibrate import build
from sound_server.complaints import Complaints
from sound_server.engine import Engine
from sound_server.events import StrikeRing
from sound_server.link import Link
from sound_server.sinks.sink import Sink
from sound_server.stream.desk import ContactDesk
from sound_server.strikes import StrikeDesk
from sound_server.upsample import TAPS

_TURN_S = 0.1
_CLOCK_EVERY_S = 10.0
_RETRY_S = 0.25


class DeviceLost(Exception):
    """The audio device went away. Its driver may hang when closed, so the process ends without trying."""


class Server:
    """`run` returns when `stop` is set; the sink stays open."""

    def __init__(self, rig: str, router: str, sink: Sink, stop: StopRequest) -> None:
        self._keys = Keys(rig)
        self._router = router
        self._sink = sink
        self._stop = stop
        self._id = f"{os.getpid():x}-{secrets.token_hex(3)}"
        self._complaints = Complaints(time.monotonic_ns)
        self._ring = StrikeRing()
        self._desk = StrikeDesk(self._ring, self._complaints, self._heard_boot)
        self._contacts = ContactDesk(self._complaints, self._heard_boot)
        self._boot: int | None = None  # the boot whose clock and scene are in use
        self._heard: int | None = None  # the boot of the newest message
        self._other_boot = threading.Event()
        self._scene: Scene | None = None
        self._engine: Engine | None = None

    def run(self) -> None:
        """Serve until stopped. Raises DeviceLost."""
        session = open_client(self._router, lambda: not self._stop.is_set() and not self._sink.lost)
        if session is None:
            self._check_device()
            return
        link = Link(session, self._keys, self._complaints)
        try:
            self._first_scene(link)
            if self._scene is not None:
                self._serve(link)
        finally:
            link.close()

    def _first_scene(self, link: Link) -> None:
        patience = time.monotonic() + 2.0
        while not self._stop.is_set() and not self._catch_up(link):
            self._check_device()
            if patience and time.monotonic() > patience:
                logging.info("rig %s at %s does not answer; waiting for it", self._keys.rig, self._router)
                patience = 0.0
            self._stop.wait(_RETRY_S)

    def _serve(self, link: Link) -> None:
        link.listen(self._keys.strike, self._desk.take)
        link.listen(self._keys.state, self._heard_state)
        link.announce(self._id)
        next_clock = time.monotonic() + _CLOCK_EVERY_S
        while not self._stop.wait(_TURN_S):
            self._check_device()
            link.tell(self._meter())
            if self._other_boot.is_set():
                self._other_boot.clear()
                if not self._catch_up(link):
                    self._other_boot.set()
            elif time.monotonic() >= next_clock:
                next_clock = time.monotonic() + _CLOCK_EVERY_S
                self._desk.clock = self._contacts.clock = link.clock() or self._desk.clock

    def _catch_up(self, link: Link) -> bool:
        # Take over the haptic server's clock and scene; False when it does not answer. The clock comes first: should
        # the servo restart in between, its next message differs from the boot noted here, and we come back.
        clock = link.clock()
        scene = link.scene()
        if scene is None:
            return False
        self._boot = clock.boot if clock else self._heard
        self._desk.clock = self._contacts.clock = clock
        if scene != self._scene:
            self._play(scene)
        link.hear_contacts(self._contacts.take if self._desk.note is not None else None)
        return True

    def _play(self, scene: Scene) -> None:
        engine = build(scene, self._sink.rate_Hz, self._ring)
        if engine.stream is not None:
            self._desk.note = self._contacts.note  # a contact sounds once: as it comes, or by its strike
        self._sink.play(engine)
        self._desk.latency_s = scene.drum.latency_s
        self._contacts.play_on(engine.stream, scene.drum.latency_s)
        if engine.stream is None:
            self._desk.note = None
        self._scene, self._engine = scene, engine
        logging.info("%s at %d Hz: %s, %s", self._sink.words, self._sink.rate_Hz, scene.name, words(engine))

    def _heard_boot(self, boot: int) -> None:
        self._heard = boot
        if boot != self._boot:
            self._other_boot.set()

    def _heard_state(self, payload: bytes, _now_ns: int) -> None:
        try:
            self._heard_boot(decode(payload, State).boot)
        except ValueError as error:
            self._complaints.complain(f"state ignored: {error}")

    def _check_device(self) -> None:
        if self._sink.lost:
            raise DeviceLost(f"{self._sink.words}: {self._sink.lost}")

    def _meter(self) -> Meter:
        assert self._engine is not None
        peaks: Record = self._engine.meters[0]
        control: Record = self._engine.control[0]
        interpolator_ms = 1e3 * TAPS / 2 * control["divisor"] / control["rate_Hz"]
        clock, now = self._desk.clock, time.monotonic_ns()
        return Meter(
            id=self._id,
            t_ns=clock.haptic(now) if clock else now,
            sink=self._sink.words,
            peak_left=float(peaks["peak_left"]),
            peak_right=float(peaks["peak_right"]),
            load=self._sink.load,
            xruns=self._sink.xruns,
            latency_ms=self._sink.latency_ms + float(interpolator_ms),
            played=self._desk.played + self._contacts.played,
            late=self._desk.late + self._contacts.late,
            duplicates=self._desk.duplicates + self._contacts.duplicates,
            underflows=self._contacts.underflows,
            refused=self._desk.bad + self._contacts.refused,
        )
