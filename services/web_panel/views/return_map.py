"""The return map: v_E after a contact against v_E after the next one, as played and as theory has it."""

import numpy as np
import viser
import viser.uplot

from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_data import joined, largest, top_of
from web_panel.views.plot_style import AMBER, BLUE, GREEN, GREY, Missing, axis, dots, line, plot
from web_panel.views.theory_client import TheoryClient

_PERIOD_S = 0.25
_MIN_M_PER_S = 0.1
_NONE = (np.empty(0), np.empty(0))


class ReturnMapView:
    """The return map; where the line crosses the diagonal a roll repeats itself. Main thread."""

    needs: frozenset[str] = frozenset()

    def __init__(self, gui: viser.GuiApi, order: float, theorist: TheoryClient) -> None:
        self._theorist = theorist
        self._drawn_at = float("-inf")
        self._top = 1.0
        self._missing = Missing(gui, order)
        self._plot = plot(
            gui,
            (
                viser.uplot.Series(label="v_E now, m/s"),
                line("predicted", "next", BLUE),
                line("no change", "next", GREY, 1.0, (4.0, 4.0)),
                dots("played, last 10 s", "next", AMBER, 6.0),
                dots("predicted roll", "next", GREEN, 14.0, hollow=True),
            ),
            scales=self._scales(),
            axes=(axis("x", 2, GREY, "v_E after a contact, m/s"), axis("next", 3, GREY, "v_E after the next, m/s")),
            order=order + 0.01,
        )  # fmt: skip

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Redraw when it is time."""
        if now - self._drawn_at < _PERIOD_S:
            return
        self._drawn_at = now
        played = history.steps()
        theory = self._theorist.theory(rig_state)
        predicted, fixed = (_NONE, _NONE) if theory is None else (theory.mapped, theory.stable)
        self._missing.say("" if theory is None else theory.missing or theory.ends)
        top = top_of(largest((predicted[0], predicted[1], played[0], played[1])), _MIN_M_PER_S)
        if top != self._top:
            self._top = top
            self._plot.scales = self._scales()
        diagonal = np.array([0.0, top]), np.array([0.0, top])
        self._plot.data = joined((predicted, diagonal), ((played[0], played[1]), fixed))

    def _scales(self) -> dict[str, viser.uplot.Scale]:
        # Given, since uPlot finds no ends among numbers of which some are missing.
        return {"x": viser.uplot.Scale(time=False), "next": viser.uplot.Scale(range=(0.0, self._top))}

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return (self._plot,)

    def remove(self) -> None:
        """Take it off the page."""
        self._missing.remove()
        self._plot.remove()
