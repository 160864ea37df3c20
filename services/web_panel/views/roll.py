"""Roll rate, strike speed and v_E; contact time and largest force: the last ten seconds."""

import numpy as np
import viser
import viser.uplot

from web_panel.rig.history import SPAN_S, PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.rig.view_subscriptions import RELEASES
from web_panel.views.plot_data import Numbers, largest, top_of
from web_panel.views.plot_style import AMBER, BLUE, CURSOR, GREEN, GREY, LEGEND, RED, axis, line

_PERIOD_S = 0.25
_FIRST_TOPS = (1.0, 1.0)


def _scales(left: str, right: str, tops: tuple[float, float]) -> dict[str, viser.uplot.Scale]:
    # Round ends, else two curves that do not change lie over each other at the top.
    return {
        "x": viser.uplot.Scale(time=False, range=(-SPAN_S, 0.0)),
        left: viser.uplot.Scale(range=(0.0, tops[0])),
        right: viser.uplot.Scale(range=(0.0, tops[1])),
    }


def _plot(
    gui: viser.GuiApi,
    left: str,
    right: str,
    colours: tuple[str, str],
    series: tuple[viser.uplot.Series, ...],
    order: float,
) -> viser.GuiUplotHandle:
    empty = np.array([-SPAN_S, 0.0])
    return gui.add_uplot(
        (empty, *(np.zeros(2) for _ in series)),
        (viser.uplot.Series(label="time, s"), *series),
        scales=_scales(left, right, _FIRST_TOPS),
        axes=(axis("x", 2, GREY, "time, s"), axis(left, 3, colours[0], left), axis(right, 1, colours[1], right)),
        cursor=CURSOR,
        legend=LEGEND,
        height=170,
        padding=(8, 8, 0, 0),  # a line at the top of its scale stays whole
        order=order,
    )  # fmt: skip


def _columns(found: Numbers) -> tuple[Numbers, ...]:
    # uPlot wants two points at least.
    return tuple(np.ascontiguousarray(column) for column in found)


class RollView:
    """Drawn four times a second while something is heard. Main thread."""

    needs = frozenset({RELEASES})

    def __init__(self, gui: viser.GuiApi, order: float) -> None:
        self._drawn_at = float("-inf")
        self._tops: dict[str, tuple[float, float]] = {}
        self._roll = _plot(
            gui,
            "Hz",
            "m/s",
            (BLUE, AMBER),
            (
                line("roll rate, Hz", "Hz", BLUE),
                line("v_E, m/s", "m/s", GREEN),
                line("strike speed, m/s", "m/s", AMBER),
            ),
            order,
        )
        self._contacts = _plot(
            gui,
            "ms",
            "N",
            (BLUE, RED),
            (line("contact time, ms", "ms", BLUE), line("largest force, N", "N", RED)),
            order + 0.1,
        )

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Redraw when it is time."""
        if now - self._drawn_at < _PERIOD_S:
            return
        self._drawn_at = now
        for plot, (left, right), found in (
            (self._roll, ("Hz", "m/s"), history.roll(now)),
            (self._contacts, ("ms", "N"), history.contacts(now)),
        ):
            if found.shape[1] < 2:
                continue
            tops = top_of(1.02 * largest([found[1]]), 1.0), top_of(1.02 * largest(list(found[2:])), 0.1)
            if tops != self._tops.get(left, _FIRST_TOPS):
                self._tops[left] = tops
                plot.scales = _scales(left, right, tops)
            plot.data = _columns(found)

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return self._roll, self._contacts

    def remove(self) -> None:
        """Take it off the page."""
        self._roll.remove()
        self._contacts.remove()
