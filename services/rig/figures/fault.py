"""The ticks before a fault: height, speed, force and the time between ticks; all of them, and the last ones closely."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from haptic_server.records import STALL_FAULT_S
from haptic_server.servo.force.guard import STALL_PAUSE_S
from rig.figures.style import BLUE, DPI, GREEN, GREY, HEAD, INK, ORANGE, PURPLE, VERMILION, styled
from rig.last_fault import LastFault

_CLOSE_TICKS = 40
_MS = 1e3
_MAX_M = 10.0  # what is told from farther away is no position of an arm
_MIN_SPAN = 1.0  # of an axis whose values are all the same, or rounding would be drawn large
_SIZE_IN = (9.6, 7.2)


class _Row(NamedTuple):
    label: str
    values: npt.NDArray[np.float64]
    colour: str


def _draw(axes: Axes, t_ms: npt.NDArray[np.float64], row: _Row, closely: bool) -> None:
    # Forces are held from tick to tick: steps say so. Close up, each tick has its point.
    marker = {"marker": "o", "ms": 3.0} if closely else {}
    axes.plot(t_ms, row.values, color=row.colour, lw=1.3, drawstyle="steps-post", **marker)  # pyright: ignore[reportArgumentType]
    axes.axvline(0.0, color=VERMILION, lw=1.2, zorder=1)
    axes.margins(x=0.02)
    finite = row.values[np.isfinite(row.values)]
    if finite.size and np.ptp(finite) < 1e-6 * _MIN_SPAN:
        axes.set_ylim(finite[0] - _MIN_SPAN, finite[0] + _MIN_SPAN)


def _draw_told(axes: Axes, last: LastFault, ticks: slice) -> None:
    # What the law refused to use shows here only. The exact stick is told nothing.
    if not np.ptp(np.nan_to_num(last.told_z_m)) > 0.0:
        return
    t_ms, told_m = last.t_s[ticks] * _MS, last.told_z_m[ticks]
    possible = np.abs(told_m) < _MAX_M
    shown_mm = np.where(possible, told_m, np.nan) * 1e3
    words = "told by the device" + ("" if possible[-1] else f"; in the end {told_m[-1]:.3g} m")
    axes.plot(t_ms, shown_mm, "x", ms=4.0, mew=1.0, color=INK, label=words, zorder=3)
    axes.legend(loc="best")


def _draw_head(axes: Axes) -> None:
    low, high = axes.get_ylim()
    if low < 0.0:
        axes.axhspan(low, min(0.0, high), color=HEAD, zorder=0, lw=0)
    axes.set_ylim(low, high)


def _draw_stalls(axes: Axes, longest_ms: float, named: bool) -> None:
    # The limits of the guard, where ticks came near them.
    axes.set_ylim(0.0, max(1.1 * longest_ms, 2.0 * _MIN_SPAN))
    for limit_s, words in ((STALL_PAUSE_S, "pause"), (STALL_FAULT_S, "fault")):
        if longest_ms > 0.4 * limit_s * _MS:
            axes.axhline(limit_s * _MS, color=GREY, lw=1.0, ls=(0, (4, 2)), zorder=1)
            if named:
                axes.annotate(
                    f" {words}, {limit_s * _MS:g} ms", (0.01, limit_s * _MS), xycoords=("axes fraction", "data"),
                    va="bottom", fontsize=8, color=INK,
                )  # fmt: skip


@styled
def fault(last: LastFault) -> Figure:
    """Four quantities over the time before the fault (ms, at 0): the whole record left, its last 40 ticks right."""
    figure = Figure(figsize=_SIZE_IN, dpi=DPI, layout="constrained")
    rows = (
        _Row("height\nz  (mm)", last.z_m * 1e3, BLUE),
        _Row("speed\nz′  (m/s)", last.v_m_per_s, GREEN),
        _Row("force  (N)", last.force_N, PURPLE),
        _Row("since the tick\nbefore  (ms)", last.span_s * _MS, ORANGE),
    )
    t_ms = last.t_s * _MS
    close = slice(max(len(t_ms) - _CLOSE_TICKS, 0), None)
    grid = figure.subplots(len(rows), 2, sharex="col", squeeze=False)
    longest_ms = float(np.nanmax(rows[-1].values, initial=0.0))
    for (whole, closely), row in zip(grid, rows, strict=True):
        _draw(whole, t_ms, row, False)
        _draw(closely, t_ms[close], row._replace(values=row.values[close]), True)
        whole.set_ylabel(row.label)
        for axes in (whole, closely):
            if row is rows[0] and axes is closely:
                _draw_told(axes, last, close)
            if row is rows[0]:
                _draw_head(axes)
            if row is rows[-1]:
                _draw_stalls(axes, longest_ms, axes is whole)
                axes.set_xlabel("time before the fault  (ms)")
    grid[0][0].set_title(f"the last {len(t_ms)} ticks")
    grid[0][1].set_title(f"the last {min(_CLOSE_TICKS, len(t_ms))} of them")
    figure.suptitle(f"{last.words}\n{last.at:%Y-%m-%d %H:%M:%S}", x=0.01, ha="left", fontsize=11)
    return figure
