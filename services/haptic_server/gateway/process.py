"""The gateway's process: it maps the servo's block, opens the wires, and relays until a signal. Main thread."""

from __future__ import annotations

import logging
import signal
from collections.abc import Callable, Mapping
from functools import partial
from ipaddress import ip_network
from typing import TYPE_CHECKING

from drumstick.analysis.ramp import Leg
from drumstick.scenes.scene_text import SceneError, parse
from drumstick.stick.law import law_of
from haptic_server import files, limits
from haptic_server.gateway.extras import Extras, MissingDependency
from haptic_server.gateway.link import wait_for_servo, warm_up
from haptic_server.gateway.options import GatewayOptions
from haptic_server.gateway.osc.osc_server import LOOPBACK, OscServer
from haptic_server.gateway.played_strikes import MIDI
from haptic_server.gateway.relay import Relay, Wires
from haptic_server.gateway.rolls.rolls import Outcome, Standing
from haptic_server.gateway.scenes.ahead import SceneAhead
from haptic_server.gateway.scenes.playing import Playing, scene_text
from haptic_server.gateway.zenoh.contacts import Contacts, contacts_of
from haptic_server.gateway.zenoh.play_queries import PlayQueries
from haptic_server.gateway.zenoh.pointer_input import Pointing
from haptic_server.gateway.zenoh.roll_queries import RollQueries
from haptic_server.gateway.zenoh.wire import Wire
from protocol.keys import Keys
from protocol.messages import PresetNews
from protocol.requests import ANYBODY
from protocol.session import open_client, open_router
from realtime.garbage import left_lying
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.service_options import options_of_process
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
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
    supervisor = Supervisor()
    try:
        playing = _playing(given, supervisor, stop)
        if playing is not None:
            _Gateway(given, playing, supervisor, stop).run()
    except _Ended as ended:
        return ended.status
    return 0


def _playing(given: GatewayOptions, supervisor: Supervisor, stop: StopRequest) -> Playing | None:
    """The scene that lies in the run folder, with its servo; None when `stop` came first."""
    path = given.run_dir / files.SCENE
    try:
        text = scene_text(given.run_dir)
        scene = parse(text, str(path))
        law = law_of(scene)
    except (OSError, UnicodeDecodeError, SceneError) as error:
        raise _Ended(_SCENE_BROKEN, f"{path} cannot be played: {error}") from None
    with left_lying():
        warm_up(law)
    waiting = partial(supervisor.notify_waiting, "waiting for the servo")
    link = wait_for_servo(given.run_dir, law, stop, waiting, round(1e9 / scene.servo.rate_Hz))
    if link is None:
        return None
    if scene_text(given.run_dir) != text:  # another scene came between the two looks
        return _playing(given, supervisor, stop)
    return Playing(given, text, link)


class _Gateway:
    """Connection of the servo's block with the wires. `_Ended` from any method: it cannot run.

    The wires outlive a scene: no datagram and no query is missed while another one takes its place.
    """

    def __init__(
        self, given: GatewayOptions, playing: Playing, supervisor: Supervisor, stop: StopRequest
    ) -> None:
        self._given, self._playing = given, playing
        self._supervisor, self._stop = supervisor, stop
        self._keys = Keys(given.rig)
        self._allow = [ip_network(each) for each in given.osc_allow] or LOOPBACK
        self._contacts: Contacts | None = None
        self._extras, self._osc = self._open_osc()
        self._osc.hear_rolls(playing.rolls)

    def _open_osc(self) -> tuple[Extras, OscServer]:
        given, playing = self._given, self._playing
        try:
            extras = Extras(given)
            front = OscServer(
                given.osc_in,
                [*given.osc_out, *extras.targets],
                given.prefix,
                playing.parameters,
                playing.presets.load,
                self._allow,
                player=playing.played,
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
        """Relay until the stop request, one scene after another."""
        session: zenoh.Session | None = None
        try:
            session = self._open_zenoh()
            if session is not None:
                self._play_on(session)
        finally:
            self._playing.rolls.close()
            if session is not None:
                session.close()
            self._extras.close()
            self._osc.close()

    def _open_zenoh(self) -> zenoh.Session | None:
        given = self._given

        def keep_trying() -> bool:
            self._supervisor.notify_waiting(f"waiting for the router {given.connect}")
            return not self._stop.is_set()

        try:
            self._extras.open(self._playing.parameters, self._osc.endpoint, self._allow, self._osc.insiders)
            if given.connect:
                return open_client(given.connect, keep_trying, given.identity)
            return open_router(given.listen)
        except OSError as error:
            raise _Ended(_LACKING, str(error)) from None

    def _health(self) -> Mapping[str, object]:
        run_dir, contacts = self._given.run_dir, self._contacts
        streamed: dict[str, object] = {} if contacts is None else {"contact": contacts.counters()}
        return {
            "servo": limits.read_object(run_dir / files.GRANTED),
            "lateness": self._playing.link.lateness(),
            "limits": limits.read_object(run_dir / files.LIMITS),
            "osc": dict(self._osc.counters),
            "queries_refused": self._wire.refused,
            "played": self._playing.played.counters,
            **streamed,
            **self._extras.counters(),
        }

    def _play_on(self, session: zenoh.Session) -> None:
        first, keys = self._playing, self._keys
        self._restore(first)
        self._wire = wire = Wire(
            session, keys, first.parameters, lambda: self._playing.link.boot, first.json, self._health,
            first.presets, first.requests,
        )  # fmt: skip
        plays = PlayQueries(keys, first.played, wire.queryables)
        rolls = RollQueries(session, keys, first.rolls, wire.queryables)
        pointing = Pointing(session, keys, first.link)
        try:
            while True:
                self._relay(session, self._playing, rolls, pointing)
                if self._stop.is_set():
                    return
                playing = _playing(self._given, self._supervisor, self._stop)
                if playing is None:
                    return
                self._restore(playing)
                before, self._playing = self._playing, playing
                playing.parameters.keep_lease(before.parameters)
                playing.requests.follow(before.requests)
                wire.play_scene(playing.parameters, playing.json, playing.presets, playing.requests)
                self._osc.play_scene(playing.parameters, playing.presets.load, playing.played)
                self._osc.hear_rolls(playing.rolls)
                self._extras.play_scene(playing.parameters)
                plays.played, rolls.rolls, pointing.link = playing.played, playing.rolls, playing.link
                before.played.release_all()  # of strikes that came between the two relays
                before.rolls.close()
                _log.info("another scene: %s", playing.scene.name)
        finally:
            self._playing.rolls.close()
            rolls.close()
            plays.close()
            wire.close()

    def _restore(self, playing: Playing) -> None:
        if (
            playing.parameters.revision == 0 and not self._given.fresh
        ):  # nobody has set anything since it started
            playing.presets.restore()

    def _relay(
        self, session: zenoh.Session, playing: Playing, roll_queries: RollQueries, pointing: Pointing
    ) -> None:
        given, link = self._given, playing.link
        self._contacts = contacts_of(playing.scene, session, self._keys, given.run_dir, lambda: link.boot)

        def publish(standing: Standing) -> None:
            roll_queries.put(standing)
            self._osc.roll(standing.rate_Hz, standing.level)

        def publish_news(news: PresetNews) -> None:
            self._wire.put_news(news)
            if news.what == "loaded":
                self._osc.preset(news.name)

        def ask(name: str, value: float, refused: Callable[[str], None]) -> None:
            if name not in ("rate", "level"):
                playing.parameters.set({name: value}, MIDI)
                return

            def answer(outcome: Outcome) -> None:
                if outcome.refusal and not outcome.superseded:
                    refused(outcome.refusal)

            playing.rolls.request({name: Leg(value)}, MIDI, ANYBODY, answer)

        playing.rolls.publish = publish
        playing.presets.on_news = publish_news
        self._osc.hear_scenes(playing.requests)
        last_good = playing.presets.keep_last()
        try:
            ahead = self._wire.ahead = SceneAhead(given.run_dir, playing.text, playing.requests.take_refusal)
            wires = Wires(
                self._wire, self._osc, pointing, self._contacts, self._extras.midi, playing.played,
                ahead,
            )  # fmt: skip
            changed = playing.rolls.note_change
            relay = Relay(given.rig, link, playing.parameters, wires, last_good, self._supervisor, changed)
            self._extras.listen_to_midi(playing.played, ask, playing.requests.ask_for_program)
            relay.run(self._stop)
        finally:
            last_good.close()
            if self._contacts is not None:
                self._contacts.close()
                self._contacts = None
