"""Progress of a start that has kernels to compile. The supervisor's thread only.

Counted from the files that appear in the store of kernels: the services, which compile, have no work with it.
"""

import os
from collections.abc import Set
from pathlib import Path

from realtime.kernels.store_folder import KERNEL_SUFFIX
from rig.supervision.parts import HAPTIC, SOUND

_LOOK_EVERY_S = 0.5
_REPORT_AFTER_S = 10.0
# Kernels that a first start needs. Measured for shipped scenes, haptic and sound together: 220 (roll) to 278 (phantom).
_NEEDED = {HAPTIC: 180, SOUND: 70}


class StartProgress:
    """Kernels compiled since `now` (monotonic, s), by whichever process, into the folder `store`."""

    def __init__(self, store: Path, parts: Set[str], now: float) -> None:
        self._store = store
        self._needed = sum(_NEEDED.get(part, 0) for part in parts)
        self._begun = now
        self._look_at = now
        self._report_after_s = _REPORT_AFTER_S
        self._changed_ns: dict[str, int] = {}  # of each folder, as last seen
        self._kernels: dict[str, int] = {}
        self._look()
        self._before = self._kernels
        self._kernels = {}  # from now on of folders that are in use: whoever uses one touches it

    def look(self, now: float) -> None:
        """Count again, if it is time."""
        if now >= self._look_at:
            self._look_at = now + _LOOK_EVERY_S
            self._look()

    def _look(self) -> None:
        # A store that is not there yet, or a folder that is cleared away meanwhile, has no kernels.
        try:
            with os.scandir(self._store) as entries:
                folders = [entry for entry in entries if entry.is_dir()]
        except OSError:
            return
        for folder in folders:
            try:
                changed_ns = folder.stat().st_mtime_ns
                if changed_ns == self._changed_ns.get(folder.name):
                    continue
                kernels = sum(name.endswith(KERNEL_SUFFIX) for name in os.listdir(folder.path))
            except OSError:
                continue
            self._changed_ns[folder.name] = changed_ns
            self._kernels[folder.name] = kernels

    @property
    def words(self) -> str:
        """Kernels compiled so far, and of about how many while that is likely; empty when none was compiled."""
        there = sum(self._before.get(name, 0) for name in self._kernels)
        compiled = sum(self._kernels.values()) - there
        if compiled <= 0:
            return ""
        # What is there already may be another scene's: then more is compiled than seemed to be left.
        left = self._needed - there
        return f"compiling {compiled} of about {left}" if compiled <= left else f"{compiled} compiled"

    def report(self, now: float, awaited: str, has_status_line: bool) -> str:
        """A line for the log, when one is due: each ten seconds while kernels are compiled, unless the status line
        shows it; otherwise after 10, 20, 40 ... seconds. `awaited`: parts that do not play yet."""
        waited_s = now - self._begun
        if waited_s < self._report_after_s:
            return ""
        if not self.words:
            self._report_after_s *= 2.0
            return f"still starting after {waited_s:.0f} s: waiting for {awaited}"
        self._report_after_s += _REPORT_AFTER_S
        if has_status_line:
            return ""
        return (
            f"{self.words} after {waited_s:.0f} s, waiting for {awaited} (only a first start, or the first after an"
            " update, compiles the instrument for this processor)"
        )
