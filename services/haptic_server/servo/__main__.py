"""python -m haptic_server.servo: owns the device, runs the tick until SIGTERM."""

from haptic_server.servo.process import main
from realtime.log import end_process

if __name__ == "__main__":
    end_process(main())
