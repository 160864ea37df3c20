"""The command line of the gateway."""

import argparse
from ipaddress import ip_network
from pathlib import Path

from protocol.access.identity import add_options, identity_of
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER

DESCRIPTION = "Zenoh and OSC for the servo in the same run folder, until SIGTERM."


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    return host or "127.0.0.1", int(port)


def read() -> argparse.Namespace:
    """run_dir, rig, listen or connect, osc_*, prefix, state_dir, ...; ends the process with status 2 when wrong."""
    parser = argparse.ArgumentParser(prog="haptic_server.gateway", description=DESCRIPTION)
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
