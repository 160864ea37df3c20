"""python -m haptic_server.servo: owns the device, runs the tick until SIGTERM."""

from realtime.garbage import importing
from realtime.kernels.jit import leave_out_blas
from realtime.log import end_process

if __name__ == "__main__":
    with importing():
        leave_out_blas()  # loads numba too: before any kernel is declared, so that none is a stand-in in a service
        from haptic_server.servo.process import main

    end_process(main())
