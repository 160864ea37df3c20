"""The command line of the sound server."""

import argparse
from collections.abc import Callable

from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, checked_rig


def _between(low: int, high: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        value = int(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{value} is outside {low} .. {high}")
        return value

    return number


def read() -> argparse.Namespace:
    """rig, connect, audio, rate, block. Ends the process with status 2 when they are wrong."""
    parser = argparse.ArgumentParser(prog="sound_server", description="Plays the drum of a rig's scene.")
    parser.add_argument("--rig", type=checked_rig, default=DEFAULT_RIG)
    parser.add_argument(
        "--connect", default=DEFAULT_ROUTER, metavar="ENDPOINT", help="the rig's Zenoh router"
    )
    parser.add_argument(
        "--audio", default="auto", metavar="auto|null|wav:FILE|NAME", help="where the sound goes"
    )
    parser.add_argument("--rate", type=_between(22050, 192000), default=48000, help="frames a second")
    parser.add_argument("--block", type=_between(16, 8192), default=128, help="frames a block")
    return parser.parse_args()
