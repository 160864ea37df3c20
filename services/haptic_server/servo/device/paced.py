"""Running a device that our own loop paces: what `run` promises, kept in one place for all of them. Control thread."""

import os
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager

from haptic_server.block_header import STOP, Cells
from haptic_server.records import NO_FAULT
from haptic_server.servo import loop
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.force.memory import Servo
from haptic_server.specification import Specification
from realtime.atomics import poke
from realtime.records import is_there
from realtime.stop import StopRequest

_POLL_S = 0.02


def require_rate(specification: Specification, servo: Servo) -> None:
    """DeviceError when the device cannot tick at the servo's rate."""
    rate_hz = round(1e9 / int(servo.plan["period_ns"][0]))
    if rate_hz not in specification.rates_Hz:
        raise DeviceError(
            f"{specification.name} does not tick at {rate_hz} Hz: set [servo] rate_Hz to {specification.rate_words}"
        )


def _pass_on(stop: StopRequest, control: Cells, over: threading.Event) -> None:
    if sys.platform == "linux":
        os.sched_setscheduler(
            0, os.SCHED_OTHER, os.sched_param(0)
        )  # not the loop's own, which a thread inherits
    while not over.wait(_POLL_S):
        if stop.is_set():
            poke(control, STOP, 1)
            return


@contextmanager
def _heard(stop: StopRequest, control: Cells) -> Generator[None]:
    # While the body runs compiled code, a request becomes the cell that this code looks at.
    over = threading.Event()
    listener = threading.Thread(target=_pass_on, args=(stop, control, over), name="stop")
    listener.start()
    try:
        yield
    finally:
        over.set()
        listener.join()


def run(specification: Specification, servo: Servo, stop: StopRequest) -> int:
    """Pace the ticks until `stop` is asked or the block's STOP cell is set; the arm feels no force after that."""
    require_rate(specification, servo)
    with _heard(stop, servo.block.control):
        first_ns = time.monotonic_ns() + int(servo.plan["period_ns"][0])
        loop.run_paced(servo, loop.NO_LOG, first_ns, loop.FOR_EVER)
    if is_there(servo.plant):
        servo.plant["force_N"] = servo.plant["queue_N"] = 0.0
    return NO_FAULT
