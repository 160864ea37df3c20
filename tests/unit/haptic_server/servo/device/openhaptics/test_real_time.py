"""The callback against a busy and a stuck interpreter: counts and ratios, no absolute times."""

import contextlib
import ctypes
import sys
import threading
from collections.abc import Callable, Generator

import pytest

from haptic_server.servo.device.openhaptics import port
from haptic_server.servo.device.openhaptics.callback import Callback
from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.rendering import render
from hd_laws import servo_at, wall
from hd_stand_in import CENTRE_MM, StandIn, playing
from realtime.kernels.jit import allocations

pytestmark = [pytest.mark.needs("cc"), pytest.mark.timeout(600)]
_MADE = (
    0.6  # of the ticks that a thread makes which has nothing to call; Python, which waits its turn, made 0.2
)


@contextlib.contextmanager
def busy() -> Generator[None]:
    """A thread that computes in Python all the time."""
    stop = threading.Event()

    def compute() -> None:
        total = 0
        while not stop.is_set():
            for n in range(100_000):
                total += n * n

    thread = threading.Thread(target=compute, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join()


def made(arm: StandIn, during: Callable[[], object]) -> float:
    """Ratio of the ticks that were called meanwhile to those of a thread of the library beside it.

    So a machine that stands still, or has other things to do, stands still for both.
    """
    arm.sim("watch", 1)
    called = arm.sim("called")
    during()
    called, witnessed = arm.sim("called") - called, arm.sim("witnessed")
    arm.sim("watch", 0)
    return called / max(witnessed, 1)


@pytest.mark.long
def test_ten_seconds_under_a_busy_interpreter(arm: StandIn) -> None:
    arm.sim("place", 0.0, CENTRE_MM[1] - 10.0, 0.0)
    servo = servo_at()
    with playing(arm, render, servo) as run, busy():
        share = made(arm, lambda: arm.sim("called_beside", 10_000))  # ten seconds of the witness
        assert run.fault is None
    assert share > _MADE
    assert servo.status[0]["tick"] == arm.sim("called")
    assert len(arm.sent()[0]) == arm.sim("called"), "every tick is one frame"
    arm.clean()


def test_it_ticks_while_one_thread_holds_the_interpreter_for_good(arm: StandIn) -> None:
    """ctypes.PyDLL keeps the interpreter's lock during the call: no Python code at all can run meanwhile."""
    await_ticks = ctypes.PyDLL(str(arm.path)).sim_await
    await_ticks.restype = ctypes.c_long
    with playing(arm, wall, servo_at()):
        assert await_ticks(ctypes.c_long(100)) >= 100
    arm.clean()


def test_a_callback_in_python_would_not_do(arm: StandIn) -> None:
    """The same scheduler, and a Python function, which waits for the interpreter."""

    @ctypes.CFUNCTYPE(ctypes.c_uint32, ctypes.c_void_p)
    def in_python(_argument: int | None) -> int:
        arm.library.hdBeginFrame(7)
        arm.library.hdEndFrame(7)
        return names.CALLBACK_CONTINUE

    arm.hd.init_device(None)
    address = ctypes.cast(in_python, ctypes.c_void_p).value or 0
    handle = arm.hd.schedule(address, 0, names.MAX_SCHEDULER_PRIORITY)
    arm.hd.start_scheduler()
    called_beside = ctypes.PyDLL(str(arm.path)).sim_called_beside
    called_beside.restype = ctypes.c_long
    arm.sim("watch", 1)
    called = called_beside(ctypes.c_long(100))
    assert arm.sim("witnessed") >= 100
    arm.sim("watch", 0)
    arm.hd.stop_scheduler()
    arm.hd.unschedule(handle)
    arm.hd.disable_device(7)
    assert called <= 1  # one may have been on its way into Python


@pytest.mark.parametrize("law", [wall, render])
def test_the_tick_allocates_nothing(arm: StandIn, law: Callable[[Servo, object, int, float], float]) -> None:
    """Without the device around it, whose watching calls from Python would count as well."""
    arm.sim("place", 0.0, CENTRE_MM[1] + 10.0, 0.0)
    handle = arm.hd.init_device(None)
    servo = servo_at()
    gate = port.make(arm.hd, handle, 1_000_000, 8.5, CENTRE_MM, has_switch=False)
    callback = Callback(law, servo, gate)
    scheduled = arm.hd.schedule(callback.function, callback.argument, names.MAX_SCHEDULER_PRIORITY)
    arm.hd.start_scheduler()
    arm.wait_ticks(50)
    references = [sys.getrefcount(array) for array in (*servo, *gate)]
    before = allocations()
    arm.sim("hand", CENTRE_MM[1] - 15.0)
    arm.wait_ticks(1000)
    after = allocations()
    assert [sys.getrefcount(array) for array in (*servo, *gate)] == references
    arm.hd.stop_scheduler()
    arm.hd.unschedule(scheduled)
    arm.hd.disable_device(handle)
    assert after == before
    assert servo.status[0]["tick"] >= 1000
    arm.clean()
