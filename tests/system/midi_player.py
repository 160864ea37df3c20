"""Notes to a JACK MIDI port whose name holds PORT_NAME: python midi_player.py PORT_NAME; a line in, `note velocity`.

A process of its own, as rtmidi2 needs one.
"""

import os
import sys

from haptic_server.gateway.midi.jack import Jack


def main() -> None:
    jack = Jack()
    if not jack.runs("player"):
        sys.exit("no JACK server")
    import rtmidi2  # ty: ignore[import-not-found]  a compiled module

    port = rtmidi2.MidiOut("player", api=rtmidi2.API_UNIX_JACK)
    (number,) = (number for number, name in enumerate(port.ports) if sys.argv[1] in name)
    port.open_port(number)
    print("plays", flush=True)
    for line in sys.stdin:
        note, velocity = map(int, line.split())
        port.send_raw(0x99, note, velocity)
    os._exit(0)  # JACK's library waits for what it never gets


main()
