"""python -m haptic_server.gateway: Zenoh and OSC for the servo in the same run folder, until SIGTERM."""

from realtime.garbage import importing
from realtime.kernels.jit import leave_out_blas
from realtime.log import end_process

if __name__ == "__main__":
    with importing():
        leave_out_blas()  # loads numba too: before any kernel is declared, so that none is a stand-in in a service
        from haptic_server.gateway.process import main

    end_process(main())
