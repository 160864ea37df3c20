"""Description of this machine, which every stored result carries."""

import datetime
import os
import platform
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from haptic_server.servo.priority import FIFO_PRIORITY

PACKAGES = (
    "haptic-drumstick", "numba", "numpy", "eclipse-zenoh", "python-osc", "sounddevice", "viser", "scipy", "matplotlib",
)  # fmt: skip


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "")


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:  # an extra that is not installed
        return None


def load() -> float | None:
    """Load average of the last minute; None on a system that knows none."""
    return round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None


def _claim() -> int:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except OSError:  # what the servo's loop is told too, which then plays at ordinary priority
        return 0
    return FIFO_PRIORITY


def real_time_priority() -> int:
    """Priority that a force loop gets here, 0: an ordinary one. Tried by a thread that ends with it."""
    if not sys.platform.startswith("linux"):
        return 0
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(_claim).result()


def description() -> dict[str, object]:
    """Machine, versions and date; `system` has the kernel's version."""
    return {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
    }
