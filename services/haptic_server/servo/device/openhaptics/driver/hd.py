"""The HD layer as Python calls it, outside the servo callback.

Control thread. Most calls block for as long as the driver likes. Errors stay on the library's own stack, one for all
threads, until somebody takes them: `errors` does.
"""

import ctypes
from typing import Any, NamedTuple

from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.openhaptics.driver.calls import Boolean, Double, Int
from haptic_server.servo.device.openhaptics.driver.faults import words_of

_MAX_ERRORS = 64


class HdError(NamedTuple):
    """One error from the library's stack."""

    code: int
    internal: int
    device: int

    def __str__(self) -> str:
        return words_of(self.code, self.internal)


class Hd:
    """A loaded library whose functions have their types (calls.declare)."""

    def __init__(self, library: Any) -> None:
        self._library = library

    def address(self, name: str) -> int:
        """Address of this function, for compiled code."""
        return int(ctypes.cast(getattr(self._library, name), ctypes.c_void_p).value or 0)

    def errors(self) -> list[HdError]:
        """Take what is on the error stack, newest first; empty when all went well."""
        found: list[HdError] = []
        while len(found) < _MAX_ERRORS:
            info = self._library.hdGetError()
            if info.code == names.SUCCESS:
                break
            found.append(HdError(int(info.code), int(info.internal), int(info.device)))
        return found

    def init_device(self, name: str | None) -> int:
        """Open a device by its configured name, or the default one; INVALID_HANDLE when that fails."""
        return int(self._library.hdInitDevice(None if name is None else name.encode()))

    def make_current(self, device: int) -> None:
        """Let the calls without a handle mean this device."""
        self._library.hdMakeCurrentDevice(device)

    def disable_device(self, device: int) -> None:
        """Let go of the device."""
        self._library.hdDisableDevice(device)

    def boolean(self, what: int) -> bool:
        """One boolean value."""
        value = Boolean(0)
        self._library.hdGetBooleanv(what, ctypes.byref(value))
        return value.value != 0

    def integer(self, what: int) -> int:
        """One integer value."""
        value = Int(0)
        self._library.hdGetIntegerv(what, ctypes.byref(value))
        return int(value.value)

    def doubles(self, what: int, count: int = 1) -> list[float]:
        """`count` doubles; nan where the library wrote nothing."""
        # Room for more than was asked: a driver that writes one value more must not write over something else.
        values = (Double * (count + 16))(*[float("nan")] * (count + 16))
        self._library.hdGetDoublev(what, values)
        return [float(value) for value in values[:count]]

    def text(self, what: int) -> str:
        """A text; empty when there is none."""
        value = self._library.hdGetString(what)
        return value.decode(errors="replace") if value else ""

    def enable(self, capability: int, wanted: bool) -> bool:
        """Switch a capability on or off; returns what it is afterwards."""
        (self._library.hdEnable if wanted else self._library.hdDisable)(capability)
        return self.is_enabled(capability)

    def is_enabled(self, capability: int) -> bool:
        """True when a capability is on."""
        return bool(self._library.hdIsEnabled(capability))

    def set_rate(self, rate_hz: int) -> None:
        """Ask for a servo rate; an error on the stack means that there is no such rate."""
        self._library.hdSetSchedulerRate(rate_hz)

    def schedule(self, callback: int, argument: int, priority: int) -> int:
        """Have the C function at address `callback` called each tick; returns its handle."""
        return int(self._library.hdScheduleAsynchronous(callback, argument, priority))

    def unschedule(self, handle: int) -> None:
        """Take a callback out."""
        self._library.hdUnschedule(handle)

    def start_scheduler(self) -> None:
        """Begin to tick."""
        self._library.hdStartScheduler()

    def stop_scheduler(self) -> None:
        """End ticking; no callback runs when it has returned."""
        self._library.hdStopScheduler()

    def check_calibration(self) -> int:
        """CALIBRATION_OK, _NEEDS_UPDATE or _NEEDS_MANUAL_INPUT."""
        return int(self._library.hdCheckCalibration())

    def update_calibration(self, style: int) -> None:
        """Calibrate in this style, now."""
        self._library.hdUpdateCalibration(style)
