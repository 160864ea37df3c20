"""The stand-in for OpenHaptics' HD library, as tests use it. Its text is stand_in.c, beside the tests of the driver."""

import contextlib
import ctypes
import functools
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from haptic_server.servo.device.openhaptics import port, protection
from haptic_server.servo.device.openhaptics.callback import Rendering, conclude
from haptic_server.servo.device.openhaptics.device import OpenHaptics
from haptic_server.servo.device.openhaptics.driver import calls, opening
from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.openhaptics.tick import begin_at, finish
from haptic_server.servo.force.memory import Servo
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.handover import ForeignHandle, load_from_address
from realtime.kernels.jit import CFunction, cfunction
from realtime.stop import StopRequest

SOURCE = Path(__file__).parent / "unit" / "haptic_server" / "servo" / "device" / "openhaptics" / "stand_in.c"
AT_BEGIN, AT_END = 1, 2
ROOM = 1 << 17
# The middle of its usable workspace, mm: x, y, z of the device's frame.
CENTRE_MM = (0.0, 53.5, 0.0)
_MAX_S = 120.0  # the first run may compile everything, on a machine that does other things too


def build(folder: Path) -> Path:
    """Compile it with the system's compiler; returns the library."""
    built = folder / "libHD.so"
    options = ["-shared", "-fPIC", "-O1", "-Wall", "-Wextra", "-Werror", "-pthread"]
    subprocess.run(["cc", *options, "-o", str(built), str(SOURCE), "-lm"], check=True, timeout=60)
    return built


class StandIn:
    """One copy of the library, with a state of its own. `sim(name, ...)` calls what begins with sim_."""

    def __init__(self, built: Path, folder: Path) -> None:
        self.path = folder / "libHD.so"
        shutil.copy(built, self.path)
        self.library = ctypes.CDLL(str(self.path))
        for name, returns in {
            "sim_words": ctypes.c_char_p,
            "sim_diary": ctypes.c_char_p,
            "sim_height": ctypes.c_double,
            "sim_force": ctypes.c_double,
            "sim_worst_gap": ctypes.c_double,
            "sim_mean_call": ctypes.c_double,
        }.items():
            getattr(self.library, name).restype = returns
        for name in ("called", "witnessed", "style_used", "layout", "sent", "bad_at"):
            getattr(self.library, f"sim_{name}").restype = ctypes.c_long
        assert calls.declare(self.library) == []
        self.hd = Hd(self.library)

    def sim(self, name: str, *values: Any) -> Any:
        """Call the test's side of it; floats go as doubles."""
        given = [ctypes.c_double(value) if isinstance(value, float) else value for value in values]
        answer = getattr(self.library, f"sim_{name}")(*given)
        return answer.decode() if isinstance(answer, bytes) else answer

    def load(self) -> tuple[str, Hd]:
        """Stand-in for `library.load` of the driver: name and functions of this library."""
        return "stand-in", self.hd

    def sent(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Every force along the device's y, N, that a frame was ended with, and the height mm that it had been told."""
        forces, heights = np.zeros(ROOM), np.zeros(ROOM)
        pointers = [array.ctypes.data_as(ctypes.c_void_p) for array in (forces, heights)]
        count = self.sim("sent", *pointers, ctypes.c_long(ROOM))
        return forces[:count], heights[:count]

    def wait(self, what: Callable[[], bool]) -> None:
        """Until `what` is true."""
        end = time.monotonic() + _MAX_S
        while not what():
            assert time.monotonic() < end, f"waited in vain; {self.sim('words')} {self.sim('diary')}"
            time.sleep(0.002)

    def wait_ticks(self, count: int) -> None:
        """Until so many more ticks were called."""
        start = self.sim("called")
        self.wait(lambda: self.sim("called") >= start + count)

    def clean(self) -> None:
        """Its caller has done nothing that a strict driver would object to."""
        assert self.sim("violations") == 0, self.sim("words")


class Playing:
    """A run of the device on a thread of its own; `fault` is what it returned."""

    def __init__(self, device: OpenHaptics, servo: Servo) -> None:
        self.stop = StopRequest()
        self.fault: int | None = None
        self.error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, args=(device, servo), daemon=True)
        self._thread.start()

    def _run(self, device: OpenHaptics, servo: Servo) -> None:
        try:
            self.fault = device.run(servo, self.stop)
        except BaseException as error:  # noqa: BLE001  told to the test's thread
            self.error = error

    def join(self) -> int:
        """Wait for its end; returns the fault."""
        self._thread.join(_MAX_S)
        assert not self._thread.is_alive()
        if self.error is not None:
            raise self.error
        assert self.fault is not None
        return self.fault


@contextlib.contextmanager
def playing(arm: StandIn, law: Rendering, servo: Servo) -> Generator[Playing, None, None]:
    """Open, run, and in the end stop and close; the first tick was made when the body begins."""
    device = OpenHaptics(law, load=arm.load)
    device.open()
    run = Playing(device, servo)
    try:
        arm.wait(lambda: arm.sim("called") > 0 or run.error is not None)
        yield run
    finally:
        run.stop.ask()
        run.join()
        device.close()


class Stepped:
    """The driver's own callback code over the stand-in, tick by tick on a clock of the test's: nothing stands still.

    Only where the clock is read differs from haptic_server.servo.device.openhaptics.callback.
    """

    def __init__(self, arm: StandIn, law: Rendering, servo: Servo) -> None:
        self.arm, self.servo = arm, servo
        self._period_ns = int(servo.plan["period_ns"][0])
        self._handle = opening.open_device(arm.hd).handle
        self._port = port.make(arm.hd, self._handle, self._period_ns, 8.5, CENTRE_MM, has_switch=False)
        self._handed = ForeignHandle((servo, self._port))
        self._function = _on_a_given_clock(law, self._handed.kind)
        self._scheduled = arm.hd.schedule(self._function.address, self._handed.address, 65535)
        protection.output_force(arm.hd, True)
        self._port.timespec[0] = 1_000_000_000

    def tick(self, count: int = 1, span_s: float = 0.0) -> None:
        """So many ticks, a period apart or `span_s`."""
        span_s = span_s or self._period_ns * 1e-9
        for _ in range(count):
            self._port.timespec[0] += round(span_s * 1e9)
            self.arm.sim("tick", span_s)

    def until(self, what: Callable[[], bool], most: int = 5000) -> None:
        """Tick until `what` is true."""
        for _ in range(most):
            if what():
                return
            self.tick()
        raise AssertionError(f"not within {most} ticks")

    def close(self) -> None:
        """Let go, in the maker's order."""
        self.arm.hd.unschedule(self._scheduled)
        self.arm.hd.disable_device(self._handle)


@functools.cache
def _on_a_given_clock(law: Rendering, kind: Any) -> CFunction:
    @cfunction("uint32(voidptr)", cache=False)
    def stepped(argument: Any) -> int:
        taken, gate = load_from_address(argument, kind)
        servo = borrowed_view(taken)
        reading, now_ns = servo.reading[0], gate.timespec[0]
        span_s = begin_at(gate, reading, now_ns)
        done = finish(gate, servo.block.control, reading, law(servo, reading, now_ns, span_s))
        conclude(servo, gate.state[0].force_N, now_ns, span_s)
        return done

    return stepped


def undisturbed(
    new: Callable[[], StandIn], play: Callable[[StandIn], None], longest_s: float = 0.015
) -> StandIn:
    """`play` with a fresh arm until the machine has not stood still meanwhile; the arm's own clock is the witness.

    The real law holds a fault after 20 ms without a tick, as it should; a shared machine may stand still for longer.
    """
    end = time.monotonic() + _MAX_S
    while time.monotonic() < end:
        arm = new()
        play(arm)
        if arm.sim("worst_gap") < longest_s:
            return arm
    raise AssertionError(
        f"this machine stood still for more than {longest_s} s in each attempt of {_MAX_S:.0f} s"
    )
