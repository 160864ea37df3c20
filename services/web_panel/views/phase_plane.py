"""The phase plane: where the stick is against how fast, the cycle that theory has, and the section E (Figure 4)."""

import numpy as np
import viser
import viser.uplot

from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_data import joined, largest, top_of
from web_panel.views.plot_style import AMBER, BLUE, GREEN, GREY, Missing, axis, dots, line, plot
from web_panel.views.theory_client import TheoryClient

_PERIOD_S = 0.2
_SPAN_S = 3.0
_NONE = (np.empty(0), np.empty(0))
_MIN_M_PER_S = 0.1


class PhasePlaneView:
    """Dots are what the servo told in the last three seconds, thirty a second; the line is one round of the exact
    motion with the servo's own parameters. Main thread."""

    needs: frozenset[str] = frozenset()

    def __init__(self, gui: viser.GuiApi, order: float, theorist: TheoryClient) -> None:
        self._theorist = theorist
        self._drawn_at = float("-inf")
        self._ends = -1.0, 1.0
        self._missing = Missing(gui, order)
        self._plot = plot(
            gui,
            (
                viser.uplot.Series(label="z, mm"),
                line("predicted, rising", "m/s", BLUE),
                line("falling", "m/s", BLUE, 1.5, (6.0, 3.0)),
                line("section E", "m/s", GREEN, 3.0),
                dots("played, last 3 s", "m/s", AMBER),
            ),
            scales=self._scales(),
            axes=(axis("x", 2, GREY, "height of the stick above the head, mm"), axis("m/s", 3, GREY, "speed, m/s")),
            order=order + 0.01,
        )  # fmt: skip

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Redraw when it is time."""
        if now - self._drawn_at < _PERIOD_S:
            return
        self._drawn_at = now
        played = history.orbit(now, _SPAN_S)
        theory = self._theorist.theory(rig_state)
        rising, falling = (_NONE, _NONE) if theory is None else (theory.rising, theory.falling)
        self._missing.say("" if theory is None else theory.missing)
        speeds = (rising[1], falling[1], played[1])
        ends = -top_of(largest([-v for v in speeds]), _MIN_M_PER_S), top_of(largest(speeds), _MIN_M_PER_S)
        if ends != self._ends:
            self._ends = ends
            self._plot.scales = self._scales()
        section = np.zeros(2), np.array([0.0, ends[1]])
        self._plot.data = joined((rising, falling), (section, (played[0], played[1])))

    def _scales(self) -> dict[str, viser.uplot.Scale]:
        # Given, since uPlot finds no ends among numbers of which some are missing.
        return {"x": viser.uplot.Scale(time=False), "m/s": viser.uplot.Scale(range=self._ends)}

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return (self._plot,)

    def remove(self) -> None:
        """Take it off the page."""
        self._missing.remove()
        self._plot.remove()
