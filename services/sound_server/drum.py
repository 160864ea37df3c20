"""One rig's drum: which scene it plays, by which clock its strikes come, in which slot of the mixer it sounds.

Each drum has a thread of its own, so that a rig that does not answer holds up no other; strikes and states come on the
link's threads.
"""

import logging
import threading
import time
from collections.abc import Callable

from drumstick.drum.build import Unplayable, copy_of, describe_renderer
from drumstick.drum.calibrate import build
from drumstick.drum.engine import Control, Engine, Meters, hears_others
from drumstick.drum.fitting import fitted
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.output.fade import FADE_S, RINGS_ON_S
from drumstick.drum.output.output_meter import OutputMeter
from drumstick.drum.output.upsample import TAPS
from drumstick.drum.pickups.places import be_at, other_places
from drumstick.drum.stems.separation import source_names
from drumstick.parameters.scene import Scene
from protocol.messages import NO_REVISION, Meter, State, decode
from protocol.rate_limited_log import RateLimitedLog
from realtime.garbage import left_lying
from realtime.records import is_there
from realtime.stop import StopRequest
from sound_server.display import DrumDisplay
from sound_server.mixer import MixerFull
from sound_server.output_trim import OutputTrim
from sound_server.outputs import RigOutputs, of_rig
from sound_server.pickup_moves import PickupMoves, moved
from sound_server.receiving.contacts import ContactScheduler
from sound_server.receiving.link import Link
from sound_server.receiving.live_values import LiveValues
from sound_server.receiving.strikes import StrikeScheduler
from sound_server.replacement import MadeDrum, Replacement
from sound_server.sinks.sink import Sink

_PATIENCE_S = 2.0
_RETRY_S = 0.25
_TURN_S = 0.1
_FADING_S = 0.02
_SCENE_RINGS_ON_S = 1.0  # a drum whose scene has ended
_NO_TRIM = OutputTrim()
_ON_ONE_PAIR = of_rig((), "")


class Drum:
    """Follows the rig at the other end of `link` until `stop`; `ident` names this server on the network."""

    def __init__(
        self,
        link: Link,
        sink: Sink,
        ident: str,
        limited_log: RateLimitedLog,
        stop: StopRequest,
        trim: OutputTrim = _NO_TRIM,
        outputs: RigOutputs = _ON_ONE_PAIR,
    ) -> None:
        self._stop = stop
        self._trim, self._outputs = trim, outputs
        self._link = link
        self._sink = sink
        self._id = ident
        self._log_limited = limited_log
        self._strikes = StrikeScheduler(StrikeRing(), limited_log, self._heard_boot)
        self._contacts = ContactScheduler(limited_log, self._heard_boot)
        self._strikes.choke = self._choke
        self._live_values = LiveValues(limited_log)
        self._display = DrumDisplay(link.publisher, link.keys, ident, self._haptic_ns)
        self._boot: int | None = None  # the boot whose clock and scene are in use
        self._heard: int | None = None  # the boot of the newest message
        self._other_boot = threading.Event()
        self._heard_revision = NO_REVISION  # of the set that the servo uses, by its newest state
        self._asked_revision: int | None = None  # at which the live values were asked for
        self._next_question = 0.0
        self._scene: Scene | None = None
        self._unplayable: Scene | None = None
        self._engine: Engine | None = None
        self._rest: Engine | None = None  # a copy of it that never sounds: a choke goes on with another copy
        self._before: list[Engine] = []  # in whose place it came, and which may ring on
        self._played_before = 0  # by strikes and contacts, when it came
        self._slot = 0
        self._next_clock = 0.0
        self._ahead_named = self._ahead_asked = ""  # the scene that is made ready while this one plays
        self._ahead: MadeDrum | None = None
        self._replacement = Replacement(self._made, self._replace)
        self._pickups = PickupMoves(self._contacts.between_pieces)
        self._plays_rigs_scene = False  # the rig's may be one that cannot be played
        self._sounding_revision = NO_REVISION  # of the newest set of which everything sounds
        self._silent_after: float | None = time.monotonic() + _PATIENCE_S

    def run(self) -> None:
        """Find the rig, follow it, and tell ten times a second how the drum is, until `stop`."""
        while not self._stop.is_set() and self._scene is None:
            if not self._find():
                self._stop.wait(_RETRY_S)
        viewing = threading.Thread(target=self._display.run, args=(self._stop,), name="viewing", daemon=True)
        viewing.start()
        while not self._stop.wait(_TURN_S):
            self._turn()
        viewing.join()
        self._replacement.close()

    def leave(self, abandoned: Callable[[], bool]) -> None:
        """Have the drum fade, and wait until it has, unless `abandoned`. After `run`."""
        if self._engine is None:
            return
        with self._contacts.between_pieces:
            self._rest = None  # a choke that still comes would put another drum in its place, for good
        self._sink.mixer.leave(self._slot)
        while not abandoned() and self._sink.mixer.holds(
            self._engine
        ):  # its slot may be another drum's by then
            time.sleep(_FADING_S)

    def _turn(self) -> None:
        if self._other_boot.is_set():
            self._other_boot.clear()
            if not self._catch_up():
                self._other_boot.set()
        elif time.monotonic() >= self._next_clock:
            self._strikes.clock = self._contacts.clock = self._link.clock() or self._strikes.clock
            self._next_clock = time.monotonic() + self._link.clock_pause_s
        self._ask_live_values()
        self._sink.mixer.let_go()
        if self._ahead_named != self._ahead_asked:
            self._make_ahead(self._ahead_named)
        # Not of a scene that has ended, while the next one's is asked for.
        follows = self._plays_rigs_scene and not self._other_boot.is_set()
        heard = self._live_values.heard()
        if follows:
            # Both in every turn: pickups do not wait for another drum, which may never be built.
            built, there = self._replacement.step(heard), self._pickups.step(heard)
            if built and there:
                asked = self._asked_revision
                self._sounding_revision = NO_REVISION if asked is None else asked
        self._link.publish(self._meter())

    def _find(self) -> bool:
        if self._catch_up():
            keys = self._link.keys
            # In one order: a strike that follows a choke sounds.
            self._link.listen({keys.strike: self._strikes.take, keys.choke: self._strikes.take_choke})
            self._link.listen({keys.state: self._heard_state})
            self._link.announce(self._id)
            self._next_clock = time.monotonic() + self._link.clock_pause_s
            return True
        if (
            self._unplayable is None
            and self._silent_after is not None
            and time.monotonic() > self._silent_after
        ):
            logging.info(
                "rig %s: waiting for the force loop; a first start compiles it, which takes a minute",
                self._link.keys.rig,
            )
            self._silent_after = None
        return False

    def _catch_up(self) -> bool:
        # Take over the haptic server's clock and scene; False when it does not answer. The clock comes first: should
        # the servo restart in between, its next message differs from the boot noted here, and we come back.
        clock = self._link.clock()
        scene = self._link.scene()
        if scene is None:
            return False
        self._boot = clock.boot if clock else self._heard
        self._strikes.clock = self._contacts.clock = clock
        if scene not in (self._scene, self._unplayable):
            try:
                self._play(scene)
            except Unplayable as error:
                # The drum before goes on, if there was one; what is wrong with this one does not change by trying.
                logging.error("%s", error)
                self._unplayable = scene
            except MixerFull:
                return False  # while replaced drums ring on: it is asked for again
        self._plays_rigs_scene = scene == self._scene
        if self._engine is None:
            return False
        self._link.subscribe_contacts(self._contacts.take if self._strikes.note is not None else None)
        # Subscribed before it is asked: what is set between is heard by the one or by the other.
        self._live_values.begin_anew()
        self._link.subscribe_params(self._live_values.take)
        self._asked_revision, self._next_question = None, 0.0
        self._sounding_revision = NO_REVISION
        self._ask_live_values()
        return True

    def _ask_live_values(self) -> None:
        # At first, and whenever the servo uses another set: a readback may have been lost with its router or gateway.
        newest = self._heard_revision
        if newest == self._asked_revision or time.monotonic() < self._next_question:
            return
        readbacks = self._link.params()
        if not readbacks:
            self._log_limited.warn("the rig does not say how its drum is set; it is asked again")
            self._next_question = time.monotonic() + _PATIENCE_S
            return
        for name, payload in readbacks.items():
            self._live_values.take(name, payload)
        self._asked_revision = newest

    def _make_ahead(self, name: str) -> None:
        # Seconds, while the present drum goes on: its strikes and its sound have threads of their own.
        self._ahead_asked = name
        scene = self._link.scene("?next") if name else None
        if scene is None or scene == self._scene:
            return  # what was made stays: its turn may be coming
        try:
            self._ahead = self._made(scene)
        except Unplayable as error:
            logging.error("%s", error)

    @left_lying()
    def _made(self, scene: Scene, original: Scene | None = None) -> MadeDrum:
        ring = StrikeRing()
        fit = fitted(scene, self._sink.rate_Hz, measured_on=original)
        apart = self._outputs.known(source_names(scene))
        rest = build(self._trim.later(fit.scene), self._sink.rate_Hz, StrikeRing(), apart)
        rest.control["output_gain"] *= self._trim.gain
        # What is set holds for this scene only, not for the next one.
        listening = fit.scene if original is None else moved(fit.scene, self._live_values.heard())
        if is_there(rest.pickup_fade):  # also where they stay: it compiles what would hold up a strike later
            be_at(rest, other_places(rest, listening))
        engine = copy_of(rest, ring)
        self._sink.mixer.make_ready(engine)
        return MadeDrum(scene, fit, engine, ring, rest, self._outputs.pairs(apart), listening.listen)

    def _play(self, scene: Scene) -> None:
        made = self._ahead if self._ahead is not None and self._ahead.scene == scene else self._made(scene)
        self._ahead = made  # until it has entered: the mixer may be full
        with self._contacts.between_pieces:
            silent_in_s = self._enter(made, scene, _SCENE_RINGS_ON_S)
            self._live_values.play_on(scene, made.engine)
        self._ahead = None
        self._replacement.play(scene, silent_in_s)
        summary = self._show(made)
        there = source_names(scene)
        for name in self._outputs.apart:
            if name not in there:
                rig, has = self._link.keys.rig, ", ".join(there)
                logging.error("--outputs: %s/%s: scene %s has only %s", rig, name, scene.name, has)
        logging.info("%s at %d Hz: %s, %s", self._sink.description, self._sink.rate_Hz, scene.name, summary)

    def _replace(self, made: MadeDrum) -> float | None:
        # Seconds until the drum before is silent; None while a contact goes on, whose whole force goes to one drum.
        assert self._scene is not None
        with self._contacts.between_pieces:
            if self._contacts.is_pressed(time.monotonic_ns()):
                return None
            self._live_values.begin_with(made.engine)
            silent_in_s = self._enter(made, self._scene, RINGS_ON_S)
            self._live_values.go_on_with(made.engine)
        self._show(made)
        return silent_in_s

    def _choke(self, after_s: float) -> None:
        # What sounds ends after_s from now; a drum like it, at rest, is struck from now on. The thread of strikes.
        with self._contacts.between_pieces:
            if self._rest is None or self._engine is None:
                return
            for before in self._before:
                self._sink.mixer.hasten(before, after_s)
            if self._played == self._played_before and not self._hears_now(self._engine):
                return  # it was not struck, or choked already
            ring = StrikeRing()
            engine = copy_of(self._rest, ring)
            self._live_values.begin_with(engine)
            try:
                self._slot = self._sink.mixer.choke(self._slot, after_s, engine)
            except MixerFull as error:
                self._log_limited.warn(f"choke left out: {error}")
                return
            self._display.go_on_with(engine, self._engine)
            self._strikes.ring, self._engine = ring, engine
            self._pickups.choke(engine)
            self._contacts.move_on_to(engine.stream)
            self._live_values.go_on_with(engine)
            self._played_before = self._played

    @staticmethod
    def _hears_now(engine: Engine) -> bool:
        # Whether it may ring though nobody struck it.
        return hears_others(engine) and not engine.control["asleep"][0]

    @property
    def _played(self) -> int:
        return self._strikes.played + self._contacts.played

    def _enter(self, made: MadeDrum, scene: Scene, rings_on_s: float) -> float:
        # The new drum enters before strikes go to it, and the old one leaves only when the strikes that it had still
        # to wait for have sounded and rung: none is lost, and nothing clicks. Returns seconds until that is silent.
        engine, silent_in_s = made.engine, 0.0
        slot = self._sink.mixer.enter(engine, made.pairs)
        if is_there(engine.stream):
            self._strikes.note = self._contacts.note  # a contact sounds once: as it comes, or by its strike
        self._strikes.ring, self._strikes.scene = made.ring, scene
        if self._scene is not None:
            leaves_in_s = self._scene.drum.latency_s + self._trim.delay_s + rings_on_s
            self._sink.mixer.leave(self._slot, leaves_in_s)
            silent_in_s = leaves_in_s + FADE_S
        self._strikes.latency_s = scene.drum.latency_s + self._trim.delay_s
        self._strikes.trim_delay_s = self._trim.delay_s
        self._contacts.play_on(engine.stream, scene.drum.latency_s, self._trim.delay_s)
        if not is_there(engine.stream):
            self._strikes.note = None
        if self._engine is not None:
            self._before = [*filter(self._sink.mixer.holds, self._before), self._engine]
        self._played_before = self._played
        self._scene, self._engine, self._rest, self._slot = scene, engine, made.rest, slot
        self._pickups.play(made.fit.scene, made.listen, engine, made.rest)
        return silent_in_s

    def _show(self, made: MadeDrum) -> str:
        # Returns what renders the drum, in words.
        summary = "; ".join(filter(None, (describe_renderer(made.engine), made.fit.note)))
        self._display.show(made.fit.scene, made.engine, summary)
        with self._contacts.between_pieces:
            if self._engine is not None and self._rest is made.rest:  # it may be choked already
                self._display.go_on_with(self._engine, made.engine)
        return summary

    def _heard_boot(self, boot: int) -> None:
        self._heard = boot
        if boot != self._boot:
            self._other_boot.set()

    def _heard_state(self, payload: bytes, _now_ns: int) -> None:
        try:
            state = decode(payload, State)
        except ValueError as error:
            self._log_limited.warn(f"state ignored: {error}")
            return
        self._heard_revision = state.revision
        self._ahead_named = state.next_scene
        self._heard_boot(state.boot)

    def _haptic_ns(self, here_ns: int) -> int:
        # By the haptic machine's clock, while it is known.
        clock = self._strikes.clock
        return clock.haptic(here_ns) if clock else here_ns

    def _meter(self) -> Meter:
        assert self._engine is not None
        peaks: Meters = self._engine.meters[0]
        output: OutputMeter = self._sink.mixer.buffers.meter[0]
        control: Control = self._engine.control[0]
        interpolator_ms = 1e3 * TAPS / 2 * control["divisor"] / control["rate_Hz"]
        summary = self._strikes.arrivals.summary()
        return Meter(
            id=self._id,
            t_ns=self._haptic_ns(time.monotonic_ns()),
            sink=", ".join(filter(None, (self._sink.description, self._trim.description))),
            peak_left=float(peaks["peak_left"]),
            peak_right=float(peaks["peak_right"]),
            load=self._sink.load,
            xruns=self._sink.xruns,
            latency_ms=self._sink.latency_ms + float(interpolator_ms),
            played=self._played,
            late=self._strikes.late + self._contacts.late,
            duplicates=self._strikes.duplicates + self._contacts.duplicates,
            underflows=self._contacts.underflows,
            refused=self._strikes.refused + self._contacts.refused,
            arrival_ms=round(summary.arrival_ms, 3),
            jitter_ms=round(summary.jitter_ms, 3),
            unpunctual=summary.unpunctual,
            revision=self._sounding_revision,
            waiting=self._replacement.waiting,
            output_peak=float(output["peak"]),
            output_rms=float(output["rms"]),
            limited_frames=int(output["limited_frames"]),
            clipped_frames=int(output["clipped_frames"]),
        )
