"""The process that has the MIDI library: messages from standard input to a port, until the input ends.

Standard output gets a line of JSON whenever the port comes or goes; without a port, one with the ports that there are.
Where it listens instead, each message that came is a line too.
"""

import json
import os
import select
import signal
import time
from typing import IO, NoReturn

from haptic_server.gateway.midi.carrier import Carrier, Connection, Report
from haptic_server.gateway.midi.encoding import MESSAGE_BYTES, is_channel_message
from haptic_server.gateway.midi.library import RtMidi
from haptic_server.gateway.midi.options import MidiOptions
from realtime.service_options import options_of_process

_POLL_EVERY_S = 1.0
# JACK takes messages once a block, of 85 ms at most as a rule, and those of a closed port never.
_LEAVE_WITHIN_S = 0.25


def _own_output() -> IO[str]:
    # The libraries print to both: neither may get between the lines of JSON.
    output = os.fdopen(os.dup(1), "w", buffering=1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    return output


def _report(output: IO[str], report: Report | None) -> None:
    if report is not None:
        output.write(json.dumps(report._asdict()) + "\n")


def _carry(carrier: Carrier, library: RtMidi, output: IO[str]) -> None:
    look_at, partial = float("-inf"), b""
    last: Report | None = None
    while True:
        if time.monotonic() >= look_at:
            look_at = time.monotonic() + _POLL_EVERY_S
            report = carrier.poll()
            if report != last and report is not None:
                _report(output, report)
                last = report
        if library.jack is not None and library.jack.ended.is_set():
            _end(output, Report(False, "JACK has ended; waiting for it"))
        if not select.select([0], [], [], _POLL_EVERY_S)[0]:
            continue
        chunk = os.read(0, 4096)
        if not chunk:
            return
        partial += chunk
        whole = len(partial) - len(partial) % MESSAGE_BYTES
        for at in range(0, whole, MESSAGE_BYTES):
            gone = carrier.send(partial[at : at + MESSAGE_BYTES])
            if gone is not None:
                _report(output, gone)
                last = gone
        partial = partial[whole:]


def _listen(port: str, client: str, library: RtMidi, output: IO[str]) -> NoReturn:
    def hear(message: list[int], _delta_s: float) -> None:
        # On the library's thread. One write of a short line, so that no other line gets into it.
        if is_channel_message(message):
            os.write(output.fileno(), f"{json.dumps({'heard': message})}\n".encode())

    connection = Connection(port, client, lambda: library.inputs(hear), "strikes come from")
    last: Report | None = None
    while True:
        report = connection.poll()
        if report not in (last, None):
            _report(output, report)
            last = report
        if library.jack is not None and library.jack.ended.is_set():
            _end(output, Report(False, "JACK has ended; waiting for it"))
        if select.select([0], [], [], _POLL_EVERY_S)[0] and not os.read(0, 1):
            os._exit(0)


def _end(output: IO[str], report: Report) -> NoReturn:
    # At once: JACK's library waits for a server that has ended when its clients are closed.
    _report(output, report)
    output.flush()
    os._exit(0)


def main() -> int:
    """Carry messages until the input ends; exit status 3 without the library."""
    given = options_of_process(MidiOptions, "haptic_server.gateway.midi")
    # The end of the pipe ends it, after the notes.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    output = _own_output()
    try:
        library = RtMidi(given.client)
    except ImportError as error:
        _report(output, Report(False, f"{error}; install haptic-drumstick[midi]"))
        return 3
    if given.port is None:
        output.write(json.dumps({"ports": library.names(given.listens)}) + "\n")
        output.flush()
        os._exit(0)
    if given.listens:
        _listen(given.port, given.client, library, output)
    carrier = Carrier(given.port, given.client, library.outputs)
    _carry(carrier, library, output)
    carrier.silence()
    time.sleep(_LEAVE_WITHIN_S)
    carrier.close()
    output.flush()
    os._exit(0)
