"""The gateway's process: it maps the servo's block, opens the wires, and relays until a signal. Main thread."""

from __future__ import annotations

import json
import logging
import signal
from collections.abc import Callable, Mapping
from ipaddress import ip_network
from pathlib import Path
from typing import TYPE_CHECKING

from drumstick.analysis.inverse import why_not
from drumstick.analysis.ramp import Leg
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import SceneError, as_tables, parse
from drumstick.scenes.table import values_of
from drumstick.stick.law import law_of
from haptic_server import files, limits
from haptic_server.gateway.extras import Extras, MissingDependency
from haptic_server.gateway.link import ServoLink, wait_for_servo, warm_up
from haptic_server.gateway.options import GatewayOptions
from haptic_server.gateway.osc.osc_server import LOOPBACK, OscServer
from haptic_server.gateway.played_strikes import MIDI, PlayedStrikes
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.relay import Relay, Wires
from haptic_server.gateway.rolls.finder_process import FinderProcess
from haptic_server.gateway.rolls.options import FinderOptions
from haptic_server.gateway.rolls.rolls import Outcome, Rolls, Standing
from haptic_server.gateway.scene_requests import SceneRequests
from haptic_server.gateway.settings import Parameters
from haptic_server.gateway.zenoh.contacts import contacts_of
from haptic_server.gateway.zenoh.play_queries import PlayQueries
from haptic_server.gateway.zenoh.pointer_input import Pointing
from haptic_server.gateway.zenoh.roll_queries import RollQueries
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.presets.store import PresetStore
from protocol.keys import Keys
from protocol.requests import ANYBODY
from protocol.session import open_client, open_router
from realtime.kernels.jit import leave_out_blas
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.regular_file import read_text
from realtime.service_options import command, options_of_process
from realtime.stop import StopRequest

if TYPE_CHECKING:
    import zenoh

_log = logging.getLogger("gateway")
_SCENE_BROKEN, _WRONG, _LACKING = 1, 2, 3


class _Ended(Exception):
    """The gateway cannot run: the exit status; why is in the log."""

    def __init__(self, status: int, words: str) -> None:
        _log.error("%s", words)
        self.status = status


def main() -> int:
    """Run until SIGTERM or SIGINT; the exit status."""
    given = options_of_process(GatewayOptions, "haptic_server.gateway")
    leave_out_blas()
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
    supervisor = Supervisor()
    try:
        scene = _scene(given.run_dir / files.SCENE)
        warm_up(law_of(scene))
        link = wait_for_servo(
            given.run_dir, law_of(scene), stop, lambda: supervisor.notify_waiting("waiting for the servo")
        )
        if link is not None:
            _Gateway(given, scene, link, supervisor, stop).run()
    except _Ended as ended:
        return ended.status
    return 0


def _scene(path: Path) -> Scene:
    try:
        return parse(read_text(path, files.MAX_SCENE_BYTES), str(path))
    except (OSError, UnicodeDecodeError, SceneError) as error:
        raise _Ended(_SCENE_BROKEN, f"{path} cannot be played: {error}") from None


class _Gateway:
    """Connection of one servo's block with the wires. `_Ended` from any method: it cannot run."""

    def __init__(
        self,
        given: GatewayOptions,
        scene: Scene,
        link: ServoLink,
        supervisor: Supervisor,
        stop: StopRequest,
    ) -> None:
        self._given, self._scene, self._link = given, scene, link
        self._supervisor, self._stop = supervisor, stop
        self._parameters = Parameters(scene, link, limits.read(given.run_dir, scene), rig=given.rig)
        values = values_of(law_of(scene), self._parameters.table)
        self._presets = Presets(PresetStore(given.state_dir), self._parameters, scene.name, values)
        self._played = PlayedStrikes(scene.strike, self._parameters)
        self._allow = [ip_network(each) for each in given.osc_allow] or LOOPBACK
        finder = FinderProcess(command("haptic_server.gateway.rolls", FinderOptions(run_dir=given.run_dir)))
        self._rolls = Rolls(self._parameters, finder, why_not(scene))
        self._extras, self._osc = self._open_osc()
        self._osc.hear_rolls(self._rolls)
        self._rolls.start()

    def _open_osc(self) -> tuple[Extras, OscServer]:
        given = self._given
        try:
            extras = Extras(given)
            targets = [*given.osc_out, *extras.targets]
            load = self._presets.load
            front = OscServer(
                given.osc_in,
                targets,
                given.prefix,
                self._parameters,
                load,
                self._allow,
                play=self._played.play,
            )
        except ValueError as error:
            raise _Ended(_WRONG, str(error)) from None
        except MissingDependency as error:
            raise _Ended(_LACKING, str(error)) from None
        except OSError as error:
            host, port = given.osc_in
            why = f"OSC port {host}:{port} cannot be opened: {error.strerror}; choose another with --osc-in"
            raise _Ended(_LACKING, why) from None
        return extras, front

    def run(self) -> None:
        """Relay until the stop request."""
        try:
            session = self._open_zenoh()
            if session is not None:
                self._relay(session)
        finally:
            self._rolls.close()
            self._extras.close()
            self._osc.close()

    def _open_zenoh(self) -> zenoh.Session | None:
        given = self._given

        def keep_trying() -> bool:
            self._supervisor.notify_waiting(f"waiting for the router {given.connect}")
            return not self._stop.is_set()

        try:
            self._extras.open(self._parameters, self._osc.endpoint, self._allow, self._osc.insiders)
            if given.connect:
                return open_client(given.connect, keep_trying, given.identity)
            return open_router(given.listen)
        except OSError as error:
            raise _Ended(_LACKING, str(error)) from None

    def _relay(self, session: zenoh.Session) -> None:
        given, link, parameters, presets = self._given, self._link, self._parameters, self._presets
        keys = Keys(given.rig)
        contacts = contacts_of(self._scene, session, keys, given.run_dir, lambda: link.boot)

        def health() -> Mapping[str, object]:
            streamed: dict[str, object] = {} if contacts is None else {"contact": contacts.counters()}
            return {
                "servo": limits.read_object(given.run_dir / files.GRANTED),
                "lateness": link.lateness(),
                "limits": limits.read_object(given.run_dir / files.LIMITS),
                "osc": dict(self._osc.counters),
                "queries_refused": wire.refused,
                "played": self._played.counters,
                **streamed,
                **self._extras.counters(),
            }

        if parameters.revision == 0 and not given.fresh:  # nobody has set anything since the servo started
            presets.restore()
        last_good = presets.keep_last()
        scene_json = json.dumps(as_tables(self._scene))
        scenes = SceneRequests(given.run_dir, given.supervised, parameters.require_quiet)
        self._osc.hear_scenes(scenes)
        wire = Wire(session, keys, parameters, lambda: link.boot, scene_json, health, presets, scenes)
        plays = PlayQueries(keys, self._played, wire.queryables)
        rolls = RollQueries(session, keys, self._rolls, wire.queryables)

        def publish(standing: Standing) -> None:
            rolls.put(standing)
            self._osc.roll(standing.rate_Hz, standing.level)

        self._rolls.publish = publish

        def news(what: str, name: str) -> None:
            wire.put_news(what, name)
            if what == "loaded":
                self._osc.preset(name)

        presets.on_news = news
        try:
            wires = Wires(
                wire, self._osc, Pointing(session, keys, link), contacts, self._extras.midi, self._played
            )
            changed = self._rolls.note_change
            relay = Relay(given.rig, link, parameters, wires, last_good, self._supervisor, changed)

            def ask_roll(name: str, value: float, refused: Callable[[str], None]) -> None:
                def answer(outcome: Outcome) -> None:
                    if outcome.refusal and not outcome.superseded:
                        refused(outcome.refusal)

                self._rolls.request({name: Leg(value)}, MIDI, ANYBODY, answer)

            self._extras.listen_to_midi(self._played.play, ask_roll, scenes.ask_for_program)
            relay.run(self._stop)
        finally:
            last_good.close()
            self._rolls.close()
            rolls.close()
            plays.close()
            wire.close()
            session.close()
