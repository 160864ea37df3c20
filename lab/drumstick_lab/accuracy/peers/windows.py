"""The peers as windows of CPU time, ns of a sample at 48 kHz; and what must be installed for each."""

import shutil
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

from drumstick_lab.accuracy.peers.compiled import Library
from drumstick_lab.accuracy.peers.supercollider import RATE_HZ, Membranes
from drumstick_lab.accuracy.timing import Window, spent_ns

_UPDATES = 4e6  # of junctions, in a window
_MAX_S = 30.0
MEMBRANES = 8  # so many that starting scsynth is little beside them
# Debian's package: is it there?
PACKAGES: Mapping[str, Callable[[], bool]] = {
    "libstk-dev": lambda: Path("/usr/include/stk/Mesh2D.h").exists(),
    "faust": lambda: shutil.which("faust") is not None,
    "supercollider-server": lambda: shutil.which("scsynth") is not None,
    "sc3-plugins-server": lambda: Path("/usr/lib/SuperCollider/plugins/MembraneUGens.so").exists(),
    "g++": lambda: shutil.which("g++") is not None,
}


def missing(names: tuple[str, ...] = tuple(PACKAGES)) -> list[str]:
    """Packages that are not installed."""
    return [name for name in names if not PACKAGES[name]()]


def of_library(library: Library) -> Window:
    """A peer in this process."""
    samples = max(512, round(_UPDATES / library.junctions / 512 / 8) * 512)
    library.run(512)
    return lambda: spent_ns(lambda: library.run(samples)) / samples


def of_supercollider(folder: Path, kind: str, seconds: float) -> Window:
    """One membrane of a score of eight, less the same score without any."""
    with_them = Membranes(folder, kind, MEMBRANES, seconds)
    without = Membranes(folder, "", MEMBRANES, seconds)
    least = min(without.cpu_s() for _ in range(5))

    def window() -> float:
        nonlocal least
        least = min(least, without.cpu_s())
        return (with_them.cpu_s() - least) / (MEMBRANES * seconds * RATE_HZ) * 1e9

    return window


def versions() -> dict[str, str]:
    """Versions of the installed ones of Debian's packages, by its own tool; none where there is no such tool."""
    try:
        said = subprocess.run(
            ["dpkg-query", "-W", "-f", "${Package} ${Version}\n", *PACKAGES],
            capture_output=True,
            text=True,
            check=False,
            timeout=_MAX_S,
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return {}
    versions = dict(line.split(" ", 1) for line in said.splitlines())
    return {name: version for name, version in versions.items() if version}
