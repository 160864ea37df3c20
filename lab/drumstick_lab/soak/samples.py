"""The samples of a soak: rows of (time, who, what, value), gathered in memory and written as CSV as they come."""

import csv
from array import array
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from drumstick_lab.soak.slope import Floats

COLUMNS = ("t_s", "who", "what", "value")


def _empty() -> "array[float]":
    return array("d")


class Samples:
    """`out`: the CSV file, or None. OSError from `note` and `close` when the disk is full."""

    def __init__(self, out: Path | None = None) -> None:
        # Arrays: what watches for growth must not grow much itself.
        self._times: defaultdict[tuple[str, str], array[float]] = defaultdict(_empty)
        self._values: defaultdict[tuple[str, str], array[float]] = defaultdict(_empty)
        self._file: IO[str] | None = None
        if out is not None:
            self._file = out.open("w", encoding="utf-8", newline="")
            self._rows: Any = csv.writer(self._file)
            self._rows.writerow(COLUMNS)

    def note(self, t_s: float, who: str, values: Mapping[str, float]) -> None:
        """Note the state of one process, or of the rig, at this time."""
        for what, value in values.items():
            self._times[who, what].append(t_s)
            self._values[who, what].append(float(value))
            if self._file is not None:
                self._rows.writerow((f"{t_s:.2f}", who, what, f"{value:.10g}"))
        if self._file is not None:
            self._file.flush()

    def series(self, who: str, what: str) -> tuple[Floats, Floats]:
        """Hours and values, shapes (n,); empty for what was never noted."""
        key = (who, what)
        return np.array(self._times.get(key, _empty())) / 3600.0, np.array(self._values.get(key, _empty()))

    def whos(self, what: str) -> list[str]:
        """Names noted, in the order of coming."""
        return [who for who, noted in self._values if noted == what]

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
