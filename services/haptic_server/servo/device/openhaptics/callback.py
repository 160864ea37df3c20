"""The servo callback for the driver's scheduler: compiled for one scene's rendering, without Python and the GIL."""

import functools
from collections.abc import Callable
from typing import Any

from haptic_server.block import LATENESS_BIN_NS, LATENESS_BINS
from haptic_server.records import Reading
from haptic_server.servo.device.openhaptics.port import Port
from haptic_server.servo.device.openhaptics.tick import begin, finish
from haptic_server.servo.force.event_output import publish_status
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.trace import note
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.handover import ForeignHandle, load_from_address
from realtime.kernels.jit import CFunction, cfunction, njit

WARM_TICKS = 100  # a driver's first ticks come as it gets started
# What renders the head: (servo, reading, now_ns, span_s) -> force along the paper's z, N. Compiled code only (`njit`).
Rendering = Callable[[Servo, Reading, int, float], float]


@njit()
def conclude(servo: Servo, force_N: float, now_ns: int, span_s: float) -> None:
    """Note the force that was really sent, the tick and those that did not happen; publish the servo's status.

    Tick thread; no allocation, no locks.
    """
    status, block = servo.status[0], servo.block
    period_ns = servo.plan[0].period_ns
    status.tick += 1
    if status.tick > WARM_TICKS:
        late_ns = max(int(span_s * 1e9) - period_ns, 0)
        status.lateness_worst_ns = max(status.lateness_worst_ns, late_ns)
        status.overruns += max((late_ns + period_ns // 2) // period_ns, 0)
        block.lateness[min(late_ns // LATENESS_BIN_NS, LATENESS_BINS - 1)] += 1
    servo.tick_state[0].force_N = force_N
    head_z_m = servo.plan[0].head_z_m
    note(servo.trace, servo.motion[0], servo.tick_state[0], servo.reading[0], head_z_m, now_ns, span_s)
    publish_status(servo, now_ns)


class Callback:
    """The compiled callback and what it works on. All of it must outlive the scheduling. Control thread."""

    def __init__(self, rendering: Rendering, servo: Servo, port: Port) -> None:
        self._handed = ForeignHandle((servo, port))
        self._function = _compiled(rendering, self._handed.kind)

    @property
    def function(self) -> int:
        """Address of the C function, `uint32_t f(void *)`."""
        return self._function.address

    @property
    def argument(self) -> int:
        """Address of the callback's argument."""
        return self._handed.address


@functools.cache
def _compiled(rendering: Rendering, kind: Any) -> CFunction:
    # The parts are compiled and cached on their own; this closure over them is small and compiled in each process.
    @cfunction("uint32(voidptr)", cache=False)
    def servo_callback(argument: Any) -> int:
        taken, port = load_from_address(argument, kind)
        servo = borrowed_view(taken)
        reading = servo.reading[0]
        span_s = begin(port, reading)
        now_ns = port.state[0].now_ns
        force_N = rendering(servo, reading, now_ns, span_s)
        done = finish(port, servo.block.control, reading, force_N)
        conclude(servo, port.state[0].force_N, now_ns, span_s)
        return done

    return servo_callback
