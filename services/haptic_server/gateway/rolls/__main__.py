"""`python -m haptic_server.gateway.rolls`: see haptic_server.gateway.rolls.finder."""

import sys

from haptic_server.gateway.rolls.finder import main

if __name__ == "__main__":
    sys.exit(main())
