"""python -m haptic_server.gateway: Zenoh and OSC for the servo in the same run folder, until SIGTERM."""

from haptic_server.gateway.process import main
from realtime.log import end_process

if __name__ == "__main__":
    end_process(main())
