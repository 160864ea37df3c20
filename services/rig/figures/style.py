"""Style of all figures: sizes, type, colours. No pyplot and no lasting global state.

The colours are Okabe and Ito's, which readers with any colour vision can tell apart; nothing is said by colour
alone. `styled` must be around drawing and around saving, because ticks are made as late as that.
"""

import io
from pathlib import Path
from typing import Literal

import matplotlib
import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

Scale = Literal["linear", "log"]

INK = "#1a1a1a"
BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
SKY, PURPLE, GREY = "#56B4E9", "#CC79A7", "#8c8c8c"
HEAD = "#f0ebe3"  # where the stick is in the head
NO_ROLL, BUZZ, ROLL = "#e4e4e4", "#f3c98b", "#9ccbe6"  # areas: rest or flight, buzz, steady roll
# yellow to blue, without the dark end: contour lines and their numbers stay readable on all of it
HEAT = ListedColormap(colormaps["YlGnBu"](np.linspace(0.03, 0.68, 256)))
WIDTH_IN, HEIGHT_IN, DPI = 7.2, 4.6, 140

styled = matplotlib.rc_context(
    {
        "font.family": "DejaVu Sans",
        "mathtext.fontset": "dejavusans",
        "font.size": 10,
        "axes.titlesize": 10.5,
        "axes.titleweight": "normal",
        "axes.titlelocation": "left",
        "axes.titlepad": 8,
        "axes.labelsize": 10,
        "axes.edgecolor": INK,
        "axes.labelcolor": INK,
        "axes.linewidth": 0.8,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "xtick.color": INK,
        "ytick.color": INK,
        "xtick.labelsize": 9,
        "ytick.labelsize": 9,
        "text.color": INK,
        "lines.linewidth": 1.8,
        "legend.fontsize": 9,
        "legend.frameon": False,
        "legend.borderaxespad": 1.0,
        "hatch.linewidth": 0.7,
        "hatch.color": GREY,
        "figure.facecolor": "white",
        "axes.facecolor": "white",
        "figure.constrained_layout.h_pad": 0.07,
        "figure.constrained_layout.w_pad": 0.07,
        "svg.fonttype": "path",
        "svg.hashsalt": "haptic-drumstick",
    }
)


def sheet(
    title: str, x_label: str, y_label: str, width_in: float = WIDTH_IN, height_in: float = HEIGHT_IN
) -> tuple[Figure, Axes]:
    """An empty figure with one pair of axes; the labels name quantity and unit."""
    figure = Figure(figsize=(width_in, height_in), dpi=DPI, layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title)
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return figure, axes


def scaled(axes: Axes, which: Literal["x", "y"], scale: Scale) -> None:
    """Make one axis linear, or logarithmic with plain numbers at 1, 2 and 5."""
    if scale == "linear":
        return
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def legend_below(figure: Figure, columns: int) -> None:
    """A legend under the axes, where it can cover nothing."""
    figure.legend(loc="outside lower center", ncols=columns)


@styled
def save(figure: Figure, path: Path) -> None:
    """Write PNG or SVG, by the file's ending; the same figure gives the same bytes. Raises OSError."""
    made_by = {"Software": None} if path.suffix == ".png" else {"Date": None, "Creator": None}
    figure.savefig(path, metadata=made_by)


@styled
def drawn_png(figure: Figure) -> bytes:
    """The figure as the bytes of a PNG file."""
    out = io.BytesIO()
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()
