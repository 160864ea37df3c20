"""Lines and dots with abscissas of their own on the one rising abscissa that uPlot wants; ends of scales. Pure."""

import csv
import io
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

Numbers = npt.NDArray[np.float64]
_STEPS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0)
Pair = tuple[Numbers, Numbers]  # abscissa and ordinate, shape (n,) each


def joined(lines: Sequence[Pair], dots: Sequence[Pair]) -> tuple[Numbers, ...]:
    """The abscissa, the lines, the dots. A line is drawn between its own points and is NaN outside of them; dots are
    NaN everywhere else: uPlot draws nothing there. Lines of no point are NaN. The abscissas of lines must rise."""
    x = np.concatenate([np.empty(0), *(pair[0] for pair in (*lines, *dots))])
    order = np.argsort(x, kind="stable")
    found = [
        np.interp(x, *line, left=np.nan, right=np.nan) if len(line[0]) else np.full(len(x), np.nan)
        for line in lines
    ]
    start = sum(len(line[0]) for line in lines)
    for at, height in dots:
        column = np.full(len(x), np.nan)
        column[start : start + len(at)] = height
        start += len(at)
        found.append(column)
    return tuple(np.ascontiguousarray(column[order]) for column in (x, *found))


def top_of(value: float, least: float) -> float:
    """A round number, at least `value` and `least` > 0: the end of a scale, which then seldom changes."""
    value = max(value, least) if math.isfinite(value) else least
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{step * power:.3g}") for step in _STEPS if step * power >= value * 0.999999)


def largest(columns: Sequence[Numbers]) -> float:
    """The largest number in all of them; 0 when there is none."""
    return max((float(np.max(column)) for column in columns if len(column)), default=0.0)


def csv_text(labels: Sequence[str], columns: Sequence[Numbers]) -> bytes:
    """One column for each label, comma-separated, UTF-8; a cell is empty where the column is NaN."""
    text = io.StringIO()
    rows = csv.writer(text)
    rows.writerow(labels)
    rows.writerows(
        ["" if math.isnan(value) else f"{value:.9g}" for value in row] for row in zip(*columns, strict=True)
    )
    return text.getvalue().encode()
