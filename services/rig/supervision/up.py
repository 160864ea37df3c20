"""`drumstick up` and its parts: start the services, watch them, stop them, tell how it went."""

import dataclasses
import json
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from haptic_server import block_header, files
from protocol.endpoint import host_and_port
from protocol.foreign_text import shown
from protocol.keys import Keys
from realtime.kernels.store_folder import store_folder
from realtime.stop import on_stop_signals
from rig import checks, folder, scene_file, set_list_file
from rig.exit_status import OURS, CommandError, usage_error
from rig.machine.machine_needs import require_machine
from rig.network import osc_targets, ports
from rig.options import DEFAULT_SCENE
from rig.recording.record import check_out
from rig.scene_file import SceneFiles
from rig.supervision.parts import HAPTIC, NOT_ESSENTIAL, PANEL, SOUND
from rig.supervision.plan import Options, commands, next_servo
from rig.supervision.process import Service
from rig.supervision.router_check import require_admission
from rig.supervision.scenes import requested_scene, scene_change
from rig.supervision.scenes.next_scene import NextScene
from rig.supervision.start_progress import StartProgress
from rig.supervision.terminal import Terminal
from rig.supervision.watch import Watch

_POLL_S = 0.05
_STOP_WITHIN_S = 4.0
_STOP_UNREADY_WITHIN_S = 1.0  # of one that still compiles: it has nothing to put in order
_READY_WITHIN_S = 600.0  # the very first start compiles every kernel, on a small machine for minutes


class _NextServo:
    """The servo of a scene that was asked for, made ready beside the one that plays. It has no arm before its turn."""

    def __init__(self, options: Options, scene: SceneFiles, say: Callable[[str], None]) -> None:
        self.files = NextScene(options.folder, scene)
        self._progress = StartProgress(store_folder(), options.parts, time.monotonic())
        try:
            turn = self.files.turn
            self.service = Service("servo", next_servo(options, turn), say, pass_fds=(turn,))
            self.service.start()
        except BaseException:
            self.files.clear()
            raise

    def poll(self, now: float) -> None:
        """Look after the process, and count what is compiled."""
        self.service.poll(now)
        self._progress.look(now)

    @property
    def words(self) -> str:
        """Name of the scene and how far it is, for the status line."""
        return ", ".join(filter(None, (f"next {self.files.scene.name}", self._progress.words)))

    def cancel(self) -> None:
        """End it, and all that was laid out for it."""
        self.service.ask_to_stop()
        self.service.wait_stopped(time.monotonic() + _STOP_UNREADY_WITHIN_S, complain=False)
        self.files.clear()


class Rig:
    """The running services of one command."""

    def __init__(self, options: Options, scene: SceneFiles, terminal: Terminal) -> None:
        self._options = options
        self._scene = scene
        self._scene_before: SceneFiles | None = None
        self._next: _NextServo | None = None
        self._terminal = terminal
        self._services = [
            Service(n, c, terminal.say, n not in NOT_ESSENTIAL) for n, c in commands(options).items()
        ]
        self._watch = Watch(options.router, Keys(options.rig), options.identity)
        self._stopping = False
        self._progress = StartProgress(store_folder(), options.parts, time.monotonic())
        self._ready_at: float | None = None
        self._played_s = 0.0
        self._strikes_before = 0

    def run(self, duration_s: float | None) -> None:
        """Run until a signal or for `duration_s` seconds of play. Raises CommandError when a service cannot run
        here."""
        on_stop_signals(self._ask_to_stop)
        begun = time.monotonic()
        try:
            for service in self._services:
                service.start()
            while not self._stopping:
                now = time.monotonic()
                self._poll(now)
                awaited = "" if self._ready_at is not None else self._waits_for()
                if self._ready_at is None and not awaited:
                    self._ready_at = now
                    self._strikes_before = self._watch.strikes
                if self._ready_at is not None:
                    self._played_s = now - self._ready_at
                    if duration_s is not None and self._played_s >= duration_s:
                        break
                elif now - begun > _READY_WITHIN_S and duration_s is not None:
                    raise CommandError(OURS, f"not ready after {_READY_WITHIN_S:.0f} s: waited for {awaited}")
                else:
                    self._progress.look(now)
                    if line := self._progress.report(now, awaited, self._terminal.is_live):
                        self._terminal.say(line)
                self._terminal.status(self._status_line(awaited))
                time.sleep(_POLL_S)
        finally:
            self._stop()

    def _ask_to_stop(self, *_: object) -> None:
        self._stopping = True

    def _poll(self, now: float) -> None:
        self._follow_scene()
        for service in self._services:
            service.poll(now)
            back = self._scene_before
            if service.fault_status is not None and service.name == "servo" and back is not None:
                self._terminal.say(
                    f"the scene {self._scene.name} cannot be played here: back to the previous scene"
                )
                self._scene, self._scene_before = back, None
                back.put(self._options.folder)
                service.start_anew()  # the gateway plays on; what is latched stays so, by the block
                return
            if service.fault_status is not None:
                said = "" if service.last_line else f"{service.name} ended with status {service.fault_status}"
                raise CommandError(service.fault_status, said)  # what it said is on the terminal already
        self._watch.poll()
        if not self._awaits_listeners():
            (self._options.folder / files.LISTENERS_AWAITED).unlink(missing_ok=True)

    def _follow_scene(self) -> None:
        # Somebody asked the gateway for another scene.
        if HAPTIC not in self._options.parts:
            return
        wanted = requested_scene.take(self._options.folder, self._terminal.say, self._refuse)
        if wanted is None:
            self._see_to_next()
            return
        if block_header.was_held(self._options.folder):
            self._report_held()  # and nothing stops: a servo that starts anew has forgotten which fault it was
            return
        self._terminal.say(f"another scene: {wanted.name}")
        if self._next is not None:
            self._next.cancel()
            self._next = None
        try:
            self._next = _NextServo(self._options, wanted, self._terminal.say)
        except (
            OSError,
            CommandError,
        ) as error:  # a place that is full, a process too many: what plays goes on
            self._refuse(f"the scene {wanted.name} cannot be made ready: {error}")

    def _see_to_next(self) -> None:
        ahead = self._next
        if ahead is None:
            return
        if ahead.service.pid is None:
            ahead.cancel()  # and what it said is passed on
            self._next = None
            self._refuse(
                f"the scene {ahead.files.scene.name} cannot be played here: {self._scene.name} plays on"
            )
            return
        ahead.poll(time.monotonic())
        if ahead.files.is_ready():
            self._next = None
            self._hand_over(ahead)

    def _hand_over(self, ahead: _NextServo) -> None:
        """Let the servo that is ready follow the one that plays: never two of them have the arm. The gateway stays."""
        if block_header.was_held(self._options.folder):
            self._report_held()  # its servo goes on, and keeps its words
            ahead.cancel()
            return
        servo = next(s for s in self._services if s.name == "servo")
        servo.ask_to_stop()
        servo.wait_stopped(time.monotonic() + _STOP_WITHIN_S)
        # A panic or a fault from here on does not bring the scene back: a servo of it would take seconds to start, and
        # nobody would tell of the panic meanwhile. The one that is ready is held by the block from its first tick on.
        if ahead.service.pid is None:
            self._refuse(
                f"the scene {ahead.files.scene.name} cannot be played here: {self._scene.name} plays on"
            )
        else:
            try:
                ahead.files.put()
            except OSError as error:
                self._refuse(f"the scene {ahead.files.scene.name} cannot be played: {error.strerror}")
                with suppress(CommandError):  # what lies there is played
                    self._scene.put(self._options.folder)
            else:
                self._scene_before, self._scene = self._scene, ahead.files.scene
                servo.take_over(ahead.service)
                ahead.files.clear()
                return
        ahead.cancel()
        servo.start_anew()

    def _report_held(self) -> None:
        self._refuse(scene_change.held_words(self._options.rig))

    def _refuse(self, words: str) -> None:
        # On the terminal, and by the gateway to whoever asked.
        self._terminal.say(words)
        with suppress(
            CommandError
        ):  # a place that is full must not end what plays; the terminal has the words
            folder.put_text(self._options.folder / files.REFUSED, words)

    def _awaits_listeners(self) -> list[str]:
        parts = self._options.parts
        missing: list[str] = []
        if HAPTIC in parts and self._watch.state is None:
            missing.append("the force loop")
        if SOUND in parts and self._watch.meter is None:
            missing.append("the sound")
        return missing

    def _waits_for(self) -> str:
        """Empty when all parts play."""
        missing = self._awaits_listeners()
        if PANEL in self._options.parts and not ports.listens("127.0.0.1", self._options.panel_port):
            missing.append("the page")
        return ", ".join(missing)

    def _status_line(self, awaited: str) -> str:
        state, meter = self._watch.state, self._watch.meter
        progress = (
            f"{self._progress.words}, waiting for {awaited}" if awaited and self._progress.words else ""
        )
        if not progress and self._next is not None:
            progress = self._next.words
        if state is None:
            return progress or "starting ..."
        if progress:  # short: a line longer than the terminal is wide cannot be rewritten
            return f"{shown(state.status)} | {state.strikes} strikes | {progress}"
        sound = f" | sound load {meter.load:.0%}, {self._watch.xruns} xruns" if meter else ""
        return (
            f"{shown(state.status)} | {state.strikes} strikes"
            f" | roll {state.roll_rate_Hz:5.2f} Hz, v_E {state.v_e_m_per_s:.3f} m/s"
            f" | late p99 {state.lateness_p99_us / 1e3:.2f} ms, worst {state.lateness_worst_us / 1e3:.2f} ms{sound}"
        )

    def _stop(self) -> None:
        self._watch.poll()
        self._watch.close()
        for service in reversed(self._services):
            service.ask_to_stop()
        if self._next is not None:
            self._next.cancel()
        asked = time.monotonic()
        for service in reversed(self._services):
            plays = self._ready_at if service.name not in ("gateway", "servo") else self._watch.state
            within_s = _STOP_UNREADY_WITHIN_S if plays is None else _STOP_WITHIN_S
            service.wait_stopped(asked + within_s, complain=plays is not None)
        self._terminal.end_status()

    def summary(self) -> dict[str, Any]:
        """Summary of the run, with units in the names; null where a service was not part of it."""
        state, meter = self._watch.state, self._watch.meter
        return {
            "scene": self._scene.name,
            "rig": self._options.rig,
            "duration_s": round(self._played_s, 3),
            "strikes": self._watch.strikes - self._strikes_before if state else None,
            "roll_rate_Hz": state.roll_rate_Hz if state else None,
            "v_e_m_per_s": state.v_e_m_per_s if state else None,
            "status": state.status if state else None,
            "lateness_p99_us": state.lateness_p99_us if state else None,
            "lateness_worst_us": self._watch.worst_lateness_us if state else None,
            "overruns": self._watch.overruns if state else None,
            "sound": meter.sink if meter else None,
            "strikes_played": meter.played if meter else None,
            "xruns": self._watch.xruns if meter else None,
            "recording": str(self._options.record) if self._options.record else None,
            "restarts": {s.name: s.restarts for s in self._services},
        }


def _words(summary: dict[str, Any]) -> str:
    lines = [f"{summary['scene']}: {summary['duration_s']:.1f} s"]
    if summary["strikes"] is not None:
        lines.append(
            f"  strikes {summary['strikes']}, roll {summary['roll_rate_Hz']:.2f} Hz,"
            f" v_E {summary['v_e_m_per_s']:.3f} m/s"
        )
        lines.append(
            f"  lateness of the force loop: p99 {summary['lateness_p99_us'] / 1e3:.2f} ms,"
            f" worst {summary['lateness_worst_us'] / 1e3:.2f} ms, overruns {summary['overruns']}"
        )
    if summary["xruns"] is not None:
        lines.append(
            f"  sound: {summary['sound']}, {summary['strikes_played']} strikes played, xruns {summary['xruns']}"
        )
    restarted = ", ".join(f"{name} {n}x" for name, n in summary["restarts"].items() if n)
    if restarted:
        lines.append(f"  restarted: {restarted}")
    return "\n".join(lines)


def up(
    options: Options, scene: str, duration_s: float | None, as_json: bool, set_list: Path | None = None
) -> None:
    """Run the chosen parts of a rig; prints a summary at the end. Raises CommandError."""
    checks.duration(duration_s)
    if options.record is not None:
        check_out(options.record, "--record")
    elif options.record_force:
        usage_error("--record-force: give --record FILE.mcap too")
    listed = None
    if set_list is not None:
        if scene != DEFAULT_SCENE:
            usage_error("--set-list: its first scene plays first: leave --scene out")
        listed = set_list_file.read(set_list)
        scene = listed.scenes[0]
    require_machine()
    laid = SceneFiles(scene)
    with ExitStack() as held:
        if HAPTIC in options.parts:
            loaded = scene_file.load(scene)
            if options.record_force and loaded.drum.excitation != "streamed":
                usage_error(
                    f"--record-force: the scene {loaded.name!r} does not stream its force: play one with"
                    ' [drum] excitation = "streamed", or leave it out'
                )
            held.enter_context(folder.claim(options.folder, options.rig))
            laid = scene_file.scene_files(scene, lambda _: None)  # `load` above has said the notes
            (options.folder / files.BLOCK).unlink(missing_ok=True)  # whoever types `up` is here, and means it
            laid.put(options.folder)
            (options.folder / files.LISTENERS_AWAITED).touch()
            held.callback((options.folder / files.BLOCK).unlink, missing_ok=True)
            (options.folder / files.WANTED).unlink(missing_ok=True)
            requested_scene.clear_leftovers(options.folder)
            held.callback(requested_scene.clear_leftovers, options.folder)
            if listed is not None:
                laid = dataclasses.replace(laid, place=listed.at)  # where a change that fails comes back to
                folder.put_text(options.folder / files.SET_LIST, listed.text())
            ports.require_free_udp(*options.osc_bind, "OSC port", "--osc-in")
            if options.query is not None:
                ports.require_free_tcp(*options.query, "OSCQuery port", "--oscquery")
            if options.is_router:
                ports.require_free_tcp(*host_and_port(options.router), "Zenoh port", "--listen")
            if options.public is not None:
                public = host_and_port(options.public.endpoint)
                ports.require_free_tcp(*public, "public Zenoh port", "zenoh.public of the rig file")
            held.enter_context(osc_targets.publish_and_warn(options.folder, options.osc_sender))
        require_admission(options)
        if PANEL in options.parts:
            ports.require_free_tcp("127.0.0.1", options.panel_port, "panel port", "--panel-port")
            if options.page_lan is not None:
                ports.require_free_tcp(*options.page_lan, "the page's port on the network", "--panel-lan-at")
        rig = Rig(options, laid, Terminal())
        rig.run(duration_s)
        summary = rig.summary()
    print(json.dumps(summary) if as_json else _words(summary), file=sys.stdout)
