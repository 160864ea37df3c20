"""python -m haptic_server.servo: owns the device, runs the tick until SIGTERM."""

import sys

from haptic_server.servo.process import main

if __name__ == "__main__":
    sys.exit(main())
