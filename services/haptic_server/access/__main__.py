"""python -m haptic_server.access: a Zenoh router for other machines, over TLS, beside the gateway's own."""

import sys

from haptic_server.access.process import main

if __name__ == "__main__":
    sys.exit(main())
