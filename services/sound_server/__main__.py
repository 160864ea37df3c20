"""python -m sound_server. Exit status 0: stopped, 2: wrong request, 3: no such device, 1: the device was lost."""

import logging
import os
import signal
import sys

from realtime.stop import StopRequest
from sound_server import options
from sound_server.log import open_log


def main() -> int:
    """Make the parts, join them, run until SIGTERM or SIGINT."""
    wanted = options.read()
    open_log()
    stop = StopRequest()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop.ask)
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
