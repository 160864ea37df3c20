"""python -m haptic_server.access: a Zenoh router for other machines, over TLS, beside the gateway's own."""

from haptic_server.access.process import main
from realtime.log import end_process

if __name__ == "__main__":
    end_process(main())
