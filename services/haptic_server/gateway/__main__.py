"""python -m haptic_server.gateway: Zenoh and OSC for the servo in the same run folder, until SIGTERM."""

import argparse
import json
import logging
import signal
import sys
from collections.abc import Mapping
from ipaddress import ip_network
from pathlib import Path

from drumstick.parameters.scene import SceneError, as_tables, parse
from drumstick.parameters.table import values_of
from drumstick.stick.law import law_of
from haptic_server import files, limits
from haptic_server.gateway.extras import Extras, Lacking
from haptic_server.gateway.link import rehearse, wait_for_servo
from haptic_server.gateway.osc.front import LOOPBACK, OscFront
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.relay import Relay
from haptic_server.gateway.settings import ParameterDesk
from haptic_server.gateway.zenoh.contacts import contacts_of
from haptic_server.gateway.zenoh.pointing import Pointing
from haptic_server.gateway.zenoh.scene_door import SceneDoor
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.presets.store import PresetStore
from protocol.access.identity import add_options, identity_of
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, Keys
from protocol.session import open_client, open_router
from realtime.log import open_log
from realtime.notify import Supervisor
from realtime.regular_file import read_text
from realtime.stop import StopRequest

_log = logging.getLogger("gateway")


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    return host or "127.0.0.1", int(port)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="haptic_server.gateway", description=__doc__)
    parser.add_argument("--run-dir", type=Path, required=True, help="holds scene.toml and the servo's block")
    parser.add_argument("--rig", default=DEFAULT_RIG)
    parser.add_argument("--listen", default=DEFAULT_ROUTER, help="be the Zenoh router at this endpoint")
    parser.add_argument("--connect", help="be a client of the Zenoh router at this endpoint instead")
    parser.add_argument(
        "--osc-in", type=_address, default=("127.0.0.1", 9100), help="[host:]port to hear OSC at"
    )
    parser.add_argument(
        "--osc-out", type=_address, action="append", help="host:port to send OSC to; may repeat"
    )
    parser.add_argument("--no-osc-out", action="store_const", dest="osc_out", const=[], help="send to nobody")
    parser.add_argument("--prefix", default="/drumstick")
    parser.add_argument("--state-dir", type=Path, required=True, help="where presets are kept")
    parser.add_argument(
        "--fresh", action="store_true", help="start from the scene, not from the last good set"
    )
    parser.add_argument(
        "--osc-allow", type=ip_network, action="append", help="network that may send OSC; may repeat"
    )
    parser.add_argument(
        "--supervised", action="store_true", help="whoever starts this changes scenes when asked"
    )
    parser.add_argument("--oscquery", type=_address, help="[host:]port to serve OSCQuery at")
    parser.add_argument(
        "--oscquery-announce", action="store_true", help="over multicast DNS, even on loopback"
    )
    parser.add_argument("--midi-out", help="part of the name of the MIDI port to play, or virtual")
    parser.add_argument("--midi-note", type=int, default=38, help="0 .. 127")
    parser.add_argument("--midi-channel", type=int, default=10, help="1 .. 16")
    add_options(parser)
    given = parser.parse_args()
    try:
        given.identity = identity_of(given)
    except ValueError as error:
        parser.error(str(error))
    return given


def main() -> int:
    """Map the block, open the wires, relay until a signal."""
    given = _arguments()
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
    text = given.run_dir / files.SCENE
    try:
        scene = parse(read_text(text, files.LARGEST_SCENE_BYTES), str(text))
    except (OSError, UnicodeDecodeError, SceneError) as error:
        _log.error("%s cannot be played: %s", text, error)
        return 1
    rehearse(law_of(scene))
    supervisor = Supervisor()
    link = wait_for_servo(
        given.run_dir, law_of(scene), stop, lambda: supervisor.waiting("waiting for the servo")
    )
    if link is None:
        return 0
    desk = ParameterDesk(scene, link, limits.read(given.run_dir, scene), rig=given.rig)
    scene_values = values_of(law_of(scene), desk.table)
    presets = Presets(PresetStore(given.state_dir), desk, scene.name, scene_values)
    try:
        targets = [("127.0.0.1", 9101)] if given.osc_out is None else given.osc_out
        allow = given.osc_allow or LOOPBACK
        extras = Extras(given)
        osc = OscFront(given.osc_in, [*targets, *extras.targets], given.prefix, desk, presets.load, allow)
    except ValueError as error:
        _log.error("%s", error)
        return 2
    except Lacking as error:
        _log.error("%s", error)
        return 3
    except OSError as error:
        host, port = given.osc_in
        _log.error(
            "OSC port %s:%d cannot be opened: %s; choose another with --osc-in", host, port, error.strerror
        )
        return 3

    def keep_trying() -> bool:
        supervisor.waiting(f"waiting for the router {given.connect}")
        return not stop.is_set()

    try:
        extras.open(desk, osc.endpoint, allow, osc.insiders)
        session = (
            open_client(given.connect, keep_trying, given.identity)
            if given.connect
            else open_router(given.listen)
        )
    except OSError as error:
        _log.error("%s", error)
        extras.close()
        osc.close()
        return 3
    if session is not None:
        keys = Keys(given.rig)
        contacts = contacts_of(scene, session, keys, given.run_dir, lambda: link.boot)

        def health() -> Mapping[str, object]:
            told: dict[str, object] = {} if contacts is None else {"contact": contacts.counters()}
            return {
                "servo": limits.told(given.run_dir / files.GRANTED),
                "lateness": link.lateness(),
                "limits": limits.told(given.run_dir / files.LIMITS),
                "osc": dict(osc.counters),
                "queries_refused": wire.refused,
                **told,
                **extras.counters(),
            }

        if desk.revision == 0 and not given.fresh:  # nobody has set anything since the servo started
            presets.restore()
        last_good = presets.keep_last()
        scenes = SceneDoor(given.run_dir, given.supervised)
        wire = Wire(
            session, keys, desk, lambda: link.boot, json.dumps(as_tables(scene)), health, presets, scenes
        )

        def news(what: str, name: str) -> None:
            wire.put_news(what, name)
            if what == "loaded":
                osc.preset(name)

        presets.on_news = news
        try:
            pointing = Pointing(session, keys, link)
            relay = Relay(
                given.rig, link, desk, wire, osc, pointing, contacts, last_good, extras.midi, supervisor
            )
            relay.run(stop)
        finally:
            last_good.close()
            wire.close()
            session.close()
    extras.close()
    osc.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
