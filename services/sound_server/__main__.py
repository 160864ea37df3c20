"""python -m sound_server. Exit status 0: stopped, 2: wrong request, 3: no such device, 1: the device was lost."""

import argparse
import logging
import os
import signal
import sys
import threading
from types import FrameType

from protocol.keys import DEFAULT_RIG, DEFAULT_ROUTER, checked_rig
from sound_server.log import open_log


def _between(low: int, high: int) -> type:
    class Whole(int):
        def __new__(cls, text: str) -> "Whole":
            number = super().__new__(cls, text)
            if not low <= number <= high:
                raise argparse.ArgumentTypeError(f"{number} is outside {low} .. {high}")
            return number

    return Whole


def _arguments() -> argparse.Namespace:
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


def main() -> int:
    """Make the parts, join them, run until SIGTERM or SIGINT."""
    wanted = _arguments()
    open_log()
    stop = threading.Event()

    def hear(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    signal.signal(signal.SIGTERM, hear)
    signal.signal(signal.SIGINT, hear)
    from sound_server.server import DeviceLost, Server
    from sound_server.sinks.choose import open_sink
    from sound_server.sinks.sink import SinkError

    try:
        sink = open_sink(wanted.audio, wanted.rate, wanted.block)
    except SinkError as error:
        logging.error("%s", error)
        return error.status
    try:
        Server(wanted.rig, wanted.connect, sink, stop).run()
    except DeviceLost as lost:
        logging.error("audio device lost: %s", lost)
        sys.stderr.flush()
        os._exit(1)  # PortAudio's own exit handler would close the dead stream, and a dead JACK never answers
    sink.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
