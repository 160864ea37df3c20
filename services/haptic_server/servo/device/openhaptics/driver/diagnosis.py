"""Diagnosis of a machine without a working PHANTOM, in words. Nothing is loaded. Any thread; reads a few folders."""

import os
from collections.abc import Iterable
from pathlib import Path

_VARIABLE = "GTDD_HOME"
# What the vendor's builds lean on and today's systems no longer bring: a part of the loader's message, and the cure.
_CURES = {
    "libncurses": "libncurses.so.5 is missing: install libncurses5 (Debian 12: from an older release) or make a link "
    "from libncurses.so.6 under that name",
    "libPHANToMIO": "libPHANToMIO.so.4 is missing: it comes with the device's driver, not with OpenHaptics; run its "
    "installer, then ldconfig",
    "libPhantomIOLib": "libPhantomIOLib42.so is missing: the Touch driver brings it; run its installer, then ldconfig",
    "libraw1394": "libraw1394 is missing, for FireWire: install libraw1394-11 and link it to the name asked for",
    "wrong ELF class": "the library is for another processor or word size than this Python",
    "GLIBC": "the driver was built for a newer system than this one: take an older driver",
}


def of_library(refusals: Iterable[str], environment: dict[str, str]) -> list[str]:
    """Advice for a library that was not loaded; `refusals` are the loader's own messages."""
    text = "\n".join(refusals)
    advice = [cure for part, cure in _CURES.items() if part in text]
    if not advice:
        advice.append(
            "install OpenHaptics and the driver of your device, or set DRUMSTICK_HD_LIBRARY to the library's full path"
        )
    return advice + of_environment(environment)


def of_environment(environment: dict[str, str]) -> list[str]:
    """Faults in this process's environment that keep the driver of a Touch from working."""
    home = environment.get(_VARIABLE, "")
    if not home:
        return [
            f"{_VARIABLE} is not set: the driver looks there for the device's configuration "
            f"(often /usr/share/3DSystems or /opt/geomagic_touch_device_driver); log in again after installing it"
        ]
    if not Path(home).is_dir():
        return [f"{_VARIABLE} is {home}, which is no folder: the driver will find no configured device"]
    return []


def of_ports(folder: Path = Path("/dev")) -> list[str]:
    """Faults of the serial ports under which USB arms appear on Linux."""
    ports = sorted(folder.glob("ttyACM*"))
    if not ports:
        return [
            f"no {folder}/ttyACM* is there: a USB arm is not plugged in or has no power (others need none)"
        ]
    barred = [str(port) for port in ports if not os.access(port, os.R_OK | os.W_OK)]
    if not barred:
        return []
    return [
        f"{', '.join(barred)}: you may not read and write it; add yourself to the group that owns it "
        f"(sudo adduser $USER dialout), then log in again"
    ]


def of_machine(environment: dict[str, str], ports: Path = Path("/dev")) -> list[str]:
    """Everything that can be seen from outside, for a device that cannot be opened."""
    return of_environment(environment) + of_ports(ports)
