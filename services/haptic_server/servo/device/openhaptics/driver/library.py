"""Finding and loading OpenHaptics' HD library, once in a process. Control thread."""

import os
import sys
from collections.abc import Callable, Iterable
from typing import Any

from haptic_server.servo.device.openhaptics.driver import calls, diagnosis
from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.protocol import DeviceError

VARIABLE = "DRUMSTICK_HD_LIBRARY"
_NAMES = {
    "linux": ("libHD.so", "libHD.so.3.4", "libHD.so.3.0", "libHD.so.3"),
    "win32": ("HD.dll",),
    "darwin": ("libHD.dylib", "/Library/Frameworks/OpenHaptics.framework/OpenHaptics"),
}
_loaded: list[str] = []


def candidates(system: str, environment: dict[str, str]) -> tuple[str, ...]:
    """Libraries to try, in order: the file that the environment names and nothing else, or the platform's names."""
    chosen = environment.get(VARIABLE, "")
    if chosen:
        return (chosen,)
    return _NAMES.get(system, _NAMES["linux"])


def _first(names: Iterable[str], loader: Callable[[str], Any]) -> tuple[str, Any]:
    refused: list[str] = []
    for name in names:
        try:
            return name, loader(name)
        except OSError as error:
            refused.append(str(error) if name in str(error) else f"{name}: {error}")
    raise DeviceError(
        "OpenHaptics' HD library cannot be loaded:\n"
        + "\n".join(f"  {reason}" for reason in refused)
        + "\n"
        + "\n".join(f"  {advice}" for advice in diagnosis.of_library(refused, dict(os.environ)))
    )


def load(loader: Callable[[str], Any] = calls.Library) -> tuple[str, Hd]:
    """Load the library; returns the name that worked, and its functions. DeviceError says all that is missing.

    Some drivers fail, or crash, when they are loaded and opened a second time in one process: so the second call is
    refused, whatever became of the first one's device.
    """
    if _loaded:
        raise DeviceError(
            f"{_loaded[0]} was opened by this process before, and a driver bears that only once: start a new process"
        )
    name, library = _first(candidates(sys.platform, dict(os.environ)), loader)
    missing = calls.declare(library)
    if missing:
        raise DeviceError(
            f"{name} is not OpenHaptics' HD library, or too old: it lacks {', '.join(missing)}. "
            f"Set {VARIABLE} to the right file."
        )
    _loaded.append(name)
    return name, Hd(library)
