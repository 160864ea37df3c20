"""The command line of the sound server."""

import argparse
import sys
from collections.abc import Callable

from protocol.identity import add_options, identity_of
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, checked_rig

MOST_RIGS = 8  # half the places on the stage: each drum may be followed by its next


def _between(low: int, high: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        value = int(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} is outside {low} .. {high}")
        return value

    return number


def _rigs(text: str) -> tuple[str, ...]:
    found = tuple(dict.fromkeys(checked_rig(name) for name in text.split(",")))
    if len(found) > MOST_RIGS:
        raise argparse.ArgumentTypeError(
            f"{len(found)} rigs are more than the {MOST_RIGS} that one server plays"
        )
    return found


def read() -> argparse.Namespace:
    """rigs, connect, audio, rate, block, identity. Ends the process with status 2 when they are wrong."""
    parser = argparse.ArgumentParser(prog="sound_server", description="Plays the drum of a rig's scene.")
    parser.add_argument(
        "--rig",
        dest="rigs",
        type=_rigs,
        default=(DEFAULT_RIG,),
        metavar="RIG[,RIG...]",
        help="whose drums to play",
    )
    parser.add_argument(
        "--connect", default=DEFAULT_ROUTER, metavar="ENDPOINT", help="the rig's Zenoh router"
    )
    parser.add_argument(
        "--audio", default="auto", metavar="auto|null|wav:FILE|NAME", help="where the sound goes"
    )
    parser.add_argument("--rate", type=_between(22050, 192000), default=48000, help="frames a second")
    parser.add_argument("--block", type=_between(16, 8192), default=128, help="frames a block")
    parser.add_argument(
        "--awaited", action="store_true", help="the device was there before: play for nobody until it is back"
    )
    add_options(parser)
    given = parser.parse_args()
    try:
        given.identity = identity_of(given)
    except ValueError as error:
        parser.error(str(error))
    return given


def again(wanted: argparse.Namespace, audio: str) -> list[str]:
    """The command line that serves the same rigs through the device `audio`, which is awaited."""
    same = ["--rig", ",".join(wanted.rigs), "--connect", wanted.connect]
    if wanted.identity is not None:
        same += wanted.identity.options()
    sound = ["--audio", audio, "--rate", str(wanted.rate), "--block", str(wanted.block), "--awaited"]
    return [sys.executable, "-m", "sound_server", *same, *sound]
