"""python -m haptic_server.gateway.midi: MIDI messages from standard input to a port, until the input ends."""

import sys

from haptic_server.gateway.midi.process import main

if __name__ == "__main__":
    sys.exit(main())
