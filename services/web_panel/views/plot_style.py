"""Style of plots, and the interface of a view."""

from typing import Any, Literal, Protocol

import numpy as np
import viser
import viser.uplot

from web_panel.page import markup
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_data import csv_text

GREY, BLUE, AMBER, GREEN, RED, FAINT = "#a9b0ba", "#38a3e0", "#f2b63d", "#3fb764", "#ff7b7b", "#33363c"
NOTHING = "rgba(0,0,0,0)"


def axis(
    scale: str, side: Literal[1, 2, 3], colour: str, label: str = "", numbers_px: float = 50.0
) -> viser.uplot.Axis:
    """An axis; side 1 right, 2 below, 3 left, whose numbers have room for `numbers_px`. Only the left one and the one
    below draw the grid.
    """
    made = viser.uplot.Axis(
        scale=scale,
        side=side,
        size=30.0 if side == 2 else numbers_px,
        stroke=colour,
        grid=viser.uplot.Axis_Grid(show=side != 1, stroke=FAINT, width=1),
        ticks=viser.uplot.Axis_Ticks(stroke=FAINT, width=1),
    )
    if label:
        made["label"], made["labelSize"] = label, 18
    return made


def line(label: str, scale: str, colour: str, width: float = 2.0, dash: tuple[float, ...] = ()) -> Any:
    """A line without dots."""
    made = viser.uplot.Series(
        label=label, scale=scale, stroke=colour, width=width, points=viser.uplot.Series_Points(show=False)
    )
    if dash:
        made["dash"] = dash
    return made


def dots(label: str, scale: str, colour: str, size: float = 5.0, hollow: bool = False) -> Any:
    """Dots, or rings, without a line."""
    fill, width = (NOTHING, 2.0) if hollow else (colour, 1.0)  # without a width the legend has no mark
    points = viser.uplot.Series_Points(show=True, size=size, fill=fill, stroke=colour, width=width)
    return viser.uplot.Series(label=label, scale=scale, stroke=colour, width=0, points=points)


LEGEND = viser.uplot.Legend(show=True, live=True)  # the values below the cursor
# NaN is where a line or a dot has no value of its own: the cursor goes on to the next one that has.
CURSOR = viser.uplot.Cursor(hover=viser.uplot.Cursor_Hover(skip=(float("nan"),)))


def blank(columns: int) -> tuple[np.ndarray, ...]:
    """Data that show nothing."""
    # uPlot wants an abscissa of two points, above 0 where it is logarithmic; NaN is drawn nowhere.
    return np.array([1.0, 2.0]), *(np.full(2, np.nan) for _ in range(columns - 1))


def plot(
    gui: viser.GuiApi,
    series: tuple[Any, ...],
    scales: dict[str, viser.uplot.Scale],
    axes: tuple[viser.uplot.Axis, ...],
    order: float,
    height: int = 320,
) -> viser.GuiUplotHandle:
    """A plot that waits for its first data; `series`, the horizontal one first."""
    return gui.add_uplot(
        blank(len(series)),
        series,
        scales=scales,
        axes=axes,
        cursor=CURSOR,
        legend=LEGEND,
        height=height,
        padding=(8, 30, 0, 0),  # half of 100,000, at the end of the axis below
        order=order,
    )


def csv_of(plot: viser.GuiUplotHandle) -> bytes:
    """Table of what a plot shows, as CSV: the names of its lines, then a row for each abscissa."""
    return csv_text([series.get("label", "") for series in plot.series], plot.data)


class Missing:
    """One line above a plot that says why something is not in it."""

    def __init__(self, gui: viser.GuiApi, order: float) -> None:
        self._html = gui.add_html("", order=order)
        self._words = ""

    def say(self, words: str) -> None:
        """Empty words take no room."""
        if words != self._words:
            self._words = words
            self._html.content = markup.line(words, "missing")

    def remove(self) -> None:
        """Take it off the page."""
        self._html.remove()


class View(Protocol):
    """One thing to look at, in one browser. Main thread."""

    needs: frozenset[str]

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """Its plots, from top to bottom."""
        ...

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Bring it up to date, at most ten times a second."""
        ...

    def remove(self) -> None:
        """Take it off the page."""
        ...
