"""A MIDI port of JACK that prints what it gets: python midi_listener.py PORT_NAME; until it is ended.

A process of its own, as rtmidi2 needs one. A line is the monotonic clock in ns and the bytes in hexadecimal.
"""

import sys
import time

from haptic_server.gateway.midi.jack import Jack


def main() -> None:
    jack = Jack()
    if not jack.runs("listener"):
        sys.exit("no JACK server")
    import rtmidi2  # ty: ignore[import-not-found]  a compiled module

    def heard(message: list[int], _: float) -> None:
        print(time.monotonic_ns(), bytes(message).hex(), flush=True)

    port = rtmidi2.MidiIn("listener", api=rtmidi2.API_UNIX_JACK)
    port.callback = heard
    port.open_virtual_port(sys.argv[1])
    print("listens", flush=True)
    while not jack.ended.is_set():
        time.sleep(0.1)


main()
