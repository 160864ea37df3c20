"""The figure of a soak: memory, descriptors and lateness of every process over time."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drumstick_lab.soak.result import Result
from drumstick_lab.soak.samples import Samples
from drumstick_lab.soak.verdict import WARM_UP
from rig.figures.style import (
    BLUE,
    DPI,
    GREEN,
    GREY,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    WIDTH_IN,
    save,
    styled,
)

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, SKY, PURPLE, GREY, INK)
_LINES = ("-", "--")
_HEIGHT_IN = 8.2
_MS, _US_PER_MS = "ms", 1e3


def draw(samples: Samples, result: Result, path: Path) -> None:
    """Write it as PNG or SVG. OSError when it cannot be written."""
    save(soak_figure(samples, result), path)


@styled
def soak_figure(samples: Samples, result: Result) -> Figure:
    """Three panes over one time axis; the warm-up, which no slope counts, is shaded."""
    figure = Figure(figsize=(WIDTH_IN, _HEIGHT_IN), dpi=DPI, layout="constrained")
    panes: Any = figure.subplots(3, 1, sharex=True)
    whos = samples.whos("rss_kB")
    hours = samples.series(whos[0], "rss_kB")[0]
    unit, per_h = ("min", 60.0) if hours[-1] < 3.0 else ("h", 1.0)
    _memory(panes[0], samples, whos, per_h)
    _descriptors(panes[1], samples, whos, per_h)
    _lateness(panes[2], samples, per_h)
    for axes in panes:
        axes.axvspan(0.0, WARM_UP * hours[-1] * per_h, color="#eeeeee", zorder=0)
        axes.set_xlim(0.0, hours[-1] * per_h)
    panes[-1].set_xlabel(f"{'virtual time' if result.form.startswith('virtual') else 'time'}  ({unit})")
    figure.suptitle(
        f"{result.form}, {result.strikes} strikes, {result.strikes_per_s:.0f} a second; the warm-up is shaded",
        x=0.01, ha="left", fontsize=11,
    )  # fmt: skip
    handles, labels = panes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


def _look(at: int) -> dict[str, Any]:
    return {
        "color": _COLOURS[at % len(_COLOURS)],
        "linestyle": _LINES[at // len(_COLOURS) % 2],
        "linewidth": 1.4,
    }


def _memory(axes: Axes, samples: Samples, whos: list[str], per_h: float) -> None:
    # From the end of the warm-up on it fills the pane; the warm-up itself may leave it.
    axes.set_title("Resident memory, against its median after the warm-up")
    axes.set_ylabel("MB")
    low, high = -0.1, 0.1
    for at, who in enumerate(whos):
        hours, values = samples.series(who, "rss_kB")
        judged = values[round(len(values) * WARM_UP) :]
        middle = float(np.median(judged))
        axes.plot(hours * per_h, (values - middle) / 1e3, label=who, **_look(at))
        low, high = (
            min(low, float(judged.min() - middle) / 1e3),
            max(high, float(judged.max() - middle) / 1e3),
        )
    axes.set_ylim(1.05 * low, 1.05 * high)


def _descriptors(axes: Axes, samples: Samples, whos: list[str], per_h: float) -> None:
    axes.set_title("Open file descriptors")
    axes.set_ylabel("descriptors")
    for at, who in enumerate(whos):
        hours, values = samples.series(who, "descriptors")
        axes.plot(hours * per_h, values, **_look(at))
    axes.set_ylim(bottom=0.0)


def _lateness(axes: Axes, samples: Samples, per_h: float) -> None:
    rows = (
        ("rig", "lateness_p99_us", "force loop, p99 since the start", _US_PER_MS),
        ("rig", "lateness_worst_us", "force loop, worst since the start", _US_PER_MS),
        ("rig", "arrival_ms", "contact to the sound server", 1.0),
        ("rig", "jitter_ms", "and its spread", 1.0),
        ("process", "clock_error_us", "mapped clock, error", _US_PER_MS),
    )
    axes.set_title("Lateness")
    axes.set_ylabel(_MS)
    for at, (who, what, words, divisor) in enumerate(rows):
        hours, values = samples.series(who, what)
        if len(values):
            axes.plot(hours * per_h, np.maximum(values / divisor, 1e-3), label=words, **_look(at))
    axes.set_yscale("log")
    axes.set_ylim(top=50.0 * axes.get_ylim()[1])  # room for the legend
    axes.legend(loc="upper right", ncols=2, fontsize=8)
