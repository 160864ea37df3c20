"""python -m haptic_server.gateway: Zenoh and OSC for the servo in the same run folder, until SIGTERM."""

import sys

from haptic_server.gateway.process import main

if __name__ == "__main__":
    sys.exit(main())
