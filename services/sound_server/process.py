"""python -m sound_server. Exit status 0: stopped, 2: wrong request, 3: no such device, 1: a fault of ours."""

import contextlib
import logging
import os
import signal
import sys

import msgspec

from realtime.garbage import importing
from realtime.kernels.jit import leave_out_blas
from realtime.log import end_process, flush_log, open_log
from realtime.service_options import command, options_of_process
from realtime.stop import StopRequest
from sound_server.options import SoundOptions
from sound_server.output_trim import OutputTrim
from sound_server.outputs import channels_of


def main() -> int:
    """Make the parts, join them, run until SIGTERM or SIGINT; anew, in the same process, when the device is lost."""
    wanted = options_of_process(SoundOptions, "sound_server")
    open_log(names_level=True)
    stop, ended = StopRequest(), StopRequest()

    def end(*_: object) -> None:
        ended.ask()
        stop.ask()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    with importing():
        leave_out_blas()  # loads numba too: before any kernel is declared, so that none is a stand-in here
        from realtime.notify import Supervisor
        from sound_server.server import DeviceLost, Server
        from sound_server.sinks import reconnecting
        from sound_server.sinks.selection import open_sink
        from sound_server.sinks.sink import SinkError

    device_watch: reconnecting.DeviceWatch | None = None
    try:
        sink = open_sink(wanted.audio, wanted.rate, wanted.block, wanted.awaited, wanted.outputs)
    except SinkError as error:
        if not wanted.awaited or error.status != 3:
            logging.error("%s", error)
            return error.status
        channels = channels_of(wanted.outputs)
        sink = reconnecting.placeholder_sink(wanted.audio, error, wanted.rate, wanted.block, channels)
        device_watch = reconnecting.DeviceWatch(wanted.audio, stop)
    try:
        supervisor = Supervisor()
        trim = OutputTrim(1e-3 * wanted.room_latency_ms, wanted.room_level_dB, wanted.outputs)
        Server(
            wanted.rigs, wanted.connect, sink, stop, wanted.identity, wanted.most_rigs, trim, supervisor
        ).run()
    except DeviceLost as lost:
        logging.error("audio device lost: %s", lost)
        if ended.is_set() or not sink.is_recoverable:
            end_process(0 if ended.is_set() else 1)
        # Not closed: PortAudio would wait for ever for a JACK that is dead.
        _start_again(wanted, sink.description)
    if device_watch is not None and device_watch.found and not ended.is_set():
        _start_again(wanted, wanted.audio)
    sink.close()
    return 0


def again(wanted: SoundOptions, audio: str) -> list[str]:
    """Command line that serves the same rigs through the device `audio`, which is awaited."""
    return command("sound_server", msgspec.structs.replace(wanted, audio=audio, awaited=True))


def _start_again(wanted: SoundOptions, audio: str) -> None:
    # The process keeps its number, so whoever supervises it sees no end. What the driver had open stays behind.
    flush_log()
    for fd in (int(name) for name in os.listdir("/dev/fd")):
        if fd > sys.stderr.fileno():
            with contextlib.suppress(OSError):  # the listing's own
                os.set_inheritable(fd, False)
    os.execv(sys.executable, again(wanted, audio))
