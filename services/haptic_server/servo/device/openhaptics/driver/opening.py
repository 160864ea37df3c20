"""Opening the device: the names a driver may want, one after the other. Control thread; blocks for seconds."""

import os
from collections.abc import Sequence
from typing import NamedTuple

from haptic_server.servo.device.openhaptics.driver import diagnosis, names
from haptic_server.servo.device.openhaptics.driver.hd import Hd, HdError
from haptic_server.servo.device.protocol import DeviceError

VARIABLE = "DRUMSTICK_HD_DEVICE"
# Which of them a driver set wants is not documented, and differs; None is C's NULL.
KNOWN_NAMES: tuple[str | None, ...] = (None, "Default Device", "Default PHANToM")


class Opened(NamedTuple):
    """An open device: its handle, and under which name it was found."""

    handle: int
    name: str


def wanted(environment: dict[str, str]) -> tuple[str | None, ...]:
    """The names to try: the configured one and no other where the environment gives it, else all the known ones."""
    given = environment.get(VARIABLE, "")
    return (given,) if given else KNOWN_NAMES


def _called(name: str | None) -> str:
    return "the default (NULL)" if name is None else f'"{name}"'


def _attempt(hd: Hd, name: str | None) -> tuple[int, list[HdError]]:
    hd.errors()
    handle = hd.init_device(name)
    errors = hd.errors()
    if handle != names.INVALID_HANDLE and errors:
        hd.disable_device(handle)  # a handle with an error is a device that only seems open
        hd.errors()
        handle = names.INVALID_HANDLE
    return handle, errors


def open_device(hd: Hd, tried: Sequence[str | None] | None = None) -> Opened:
    """Open the first name that works and make it the current device. DeviceError tells what each name led to."""
    refused: list[str] = []
    for name in wanted(dict(os.environ)) if tried is None else tried:
        handle, errors = _attempt(hd, name)
        if handle != names.INVALID_HANDLE:
            hd.make_current(handle)
            return Opened(handle, _called(name))
        reasons = "; ".join(str(error) for error in errors) or "no reason given"
        refused.append(f"  {_called(name)}: {reasons}")
        if any(error.code == names.INVALID_LICENSE for error in errors):
            break  # no other name helps
    advice = [
        *(f"  {words}" for words in diagnosis.of_machine(dict(os.environ))),
        f"  {VARIABLE} may hold the name that the device was given in the vendor's setup program",
    ]
    raise DeviceError("No PHANTOM could be opened:\n" + "\n".join(refused + advice))
