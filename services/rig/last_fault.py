"""The last fault of a rig on this machine: the thousand ticks before it, which the servo left in the run folder."""

import csv
import math
import os
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
import numpy.typing as npt

from haptic_server import files
from haptic_server.records import FAULT_WORDS, NO_FAULT
from realtime.regular_file import read_lines

PICTURE = "fault.png"
_COLUMNS = ("t_ns", "span_s", "z_m", "v_m_per_s", "force_N", "told_z_m", "fault")
_MAX_BYTES = 10_000_000  # the servo's own are some 60 kB


class TraceError(ValueError):
    """Reason why a trace cannot be shown: file, line, column, value."""


@dataclass(frozen=True)
class LastFault:
    """Last fault of a servo: what, when, and the ticks before it, oldest first.

    The arrays have shape (n,). t_s counts back from the tick of the fault, which is 0; span_s is the time from the
    tick before; z_m is where the law had the stick, told_z_m what the device told; what was no number is NaN.
    """

    path: Path
    code: int
    at: datetime
    t_s: npt.NDArray[np.float64]
    span_s: npt.NDArray[np.float64]
    z_m: npt.NDArray[np.float64]
    v_m_per_s: npt.NDArray[np.float64]
    force_N: npt.NDArray[np.float64]
    told_z_m: npt.NDArray[np.float64]

    @property
    def words(self) -> str:
        """The fault in words."""
        return FAULT_WORDS.get(self.code, f"a fault without words, number {self.code}")


def _number(path: Path, line: int, name: str, text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        raise TraceError(f"{path}:{line}: {name}: {text and text[:60]!r} is not a number") from None
    return value if math.isfinite(value) else math.nan


def _rows(path: Path) -> list[list[float]]:
    reader = csv.DictReader(read_lines(path, _MAX_BYTES))
    absent = [name for name in _COLUMNS if name not in (reader.fieldnames or ())]
    if absent:
        raise TraceError(f"{path}: has no column {', '.join(absent)}")
    return [[_number(path, reader.line_num, name, row[name]) for name in _COLUMNS] for row in reader]


def read(folder: Path) -> LastFault | None:
    """The last fault of the rig that runs, or ran, in this folder; None when it had none. Raises TraceError."""
    path = folder / files.TRACE
    try:
        found = path.stat()
        if found.st_uid != os.getuid():
            raise TraceError(f"{path} belongs to somebody else")
        rows = np.array(_rows(path)).reshape(-1, len(_COLUMNS))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise TraceError(f"{path} cannot be read: {error.strerror}") from None
    except (csv.Error, UnicodeDecodeError) as error:
        raise TraceError(f"{path}: not the force loop's CSV: {error}") from None
    if len(rows) == 0:
        raise TraceError(f"{path}: has no ticks in it")
    t_ns, span_s, z, v, force, device_z, fault = rows.T
    if not (np.isfinite(t_ns).all() and fault[-1] != NO_FAULT and np.isfinite(fault[-1])):
        raise TraceError(f"{path}: does not end with a fault: written by something else, or cut off")
    at = datetime.fromtimestamp(found.st_mtime).astimezone()
    return LastFault(path, int(fault[-1]), at, (t_ns - t_ns[-1]) * 1e-9, span_s, z, v, force, device_z)
