"""The command line of the sound server."""

import argparse
import sys
from collections.abc import Callable

from protocol.access.identity import add_options, identity_of
from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER
from protocol.pattern import checked_pattern, is_pattern
from sound_server.room import MOST_LATENCY_MS, LEVELS_dB, Room

MOST_RIGS = 8  # half the places on the stage: each drum may be followed by its next


def _between(low: int, high: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        value = int(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} is outside {low} .. {high}")
        return value

    return number


def _within(low: float, high: float, unit: str) -> Callable[[str], float]:
    def number(text: str) -> float:
        value = float(text)
        if not low <= value <= high:  # nor NaN
            raise argparse.ArgumentTypeError(f"{text} is outside {low:g} .. {high:g} {unit}")
        return value

    return number


def _rigs(text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(checked_pattern(name) for name in text.split(",")))


def _check_seats(parser: argparse.ArgumentParser, rigs: tuple[str, ...], most: int) -> None:
    named = [rig for rig in rigs if not is_pattern(rig)]
    if len(named) > most:
        parser.error(
            f"--rig: {len(named)} rigs are more than the {most} that this server plays (--most-rigs)"
        )


def read() -> argparse.Namespace:
    """rigs, most, room, connect, audio, rate, block, identity. Ends the process with status 2 when they are wrong."""
    parser = argparse.ArgumentParser(prog="sound_server", description="Plays the drum of a rig's scene.")
    parser.add_argument(
        "--rig",
        dest="rigs",
        type=_rigs,
        default=(DEFAULT_RIG,),
        metavar="RIG[,RIG...]",
        help="whose drums to play; with *, of rigs that come and go",
    )
    parser.add_argument(
        "--most-rigs", dest="most", type=_between(1, MOST_RIGS), default=MOST_RIGS, help="drums at once"
    )
    _add_room(parser)
    parser.add_argument(
        "--connect", default=DEFAULT_ROUTER, metavar="ENDPOINT", help="the rig's Zenoh router"
    )
    parser.add_argument(
        "--audio", default="auto", metavar="auto|null|wav:FILE|NAME", help="where the sound goes"
    )
    parser.add_argument("--rate", type=_between(22050, 192000), default=48000, help="frames a second")
    parser.add_argument("--block", type=_between(16, 8192), default=128, help="frames a block")
    parser.add_argument("--awaited", action="store_true", help="play for nobody until the device is there")
    add_options(parser)
    given = parser.parse_args()
    given.room = Room(1e-3 * given.room_latency, given.room_level)
    _check_seats(parser, given.rigs, given.most)
    try:
        given.identity = identity_of(given)
    except ValueError as error:
        parser.error(str(error))
    return given


def _add_room(parser: argparse.ArgumentParser) -> None:
    latency = _within(0.0, MOST_LATENCY_MS, "ms")
    parser.add_argument("--room-latency", type=latency, default=0.0, metavar="MS", help="beyond the scene's")
    level = _within(*LEVELS_dB, "dB")
    parser.add_argument("--room-level", type=level, default=0.0, metavar="DB", help="beyond the scene's")


def again(wanted: argparse.Namespace, audio: str) -> list[str]:
    """The command line that serves the same rigs through the device `audio`, which is awaited."""
    same = ["--rig", ",".join(wanted.rigs), "--connect", wanted.connect]
    if wanted.identity is not None:
        same += wanted.identity.options()
    same += ["--most-rigs", str(wanted.most)]
    same += [f"--room-latency={wanted.room_latency!r}", f"--room-level={wanted.room_level!r}"]
    sound = ["--audio", audio, "--rate", str(wanted.rate), "--block", str(wanted.block), "--awaited"]
    return [sys.executable, "-m", "sound_server", *same, *sound]
