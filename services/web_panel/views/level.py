"""The scene's curve from the stick's speed to the level of a strike, and the last strikes on it."""

import numpy as np
import viser
import viser.uplot

from drumstick.parameters.strike import Strike
from drumstick.stick.strike_curve import curve_of, level_of
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_data import Numbers, Pair, joined, largest, top_of
from web_panel.views.plot_style import AMBER, BLUE, GREY, axis, dots, line, plot

_PERIOD_S = 0.25
_POINTS = 64
_ROOM = 1.1  # to the right of full scale


def line_of(strike: Strike, top_m_per_s: float) -> Pair:
    """Speeds (m/s) from 0 to the top and their levels, shape (n,); corners of the curve are among them."""
    corners = [0.0, strike.softest_m_per_s, strike.full_scale_m_per_s, *(speed for speed, _ in strike.table)]
    even = np.geomspace(1e-2, 1.0, _POINTS) * top_m_per_s  # closest where a logarithm bends most
    speeds: Numbers = np.unique([*(speed for speed in corners if speed < top_m_per_s), *even])
    curve = curve_of(strike)[0]
    return speeds, np.array([level_of(curve, float(speed)) for speed in speeds])


class LevelView:
    """Dots are the strikes of the last ten seconds, as their messages told them. Main thread."""

    needs: frozenset[str] = frozenset()

    def __init__(self, gui: viser.GuiApi, order: float) -> None:
        self._drawn_at = float("-inf")
        self._shown: tuple[Strike, float] | None = None
        self._curve: Pair = (np.empty(0), np.empty(0))
        self._plot = plot(
            gui,
            (
                viser.uplot.Series(label="speed, m/s"),
                line("level of a strike", "level", BLUE),
                dots("strikes, last 10 s", "level", AMBER),
            ),
            scales={"x": viser.uplot.Scale(time=False), "level": viser.uplot.Scale(range=(0.0, 1.05))},
            axes=(axis("x", 2, GREY, "speed of the stick, m/s"), axis("level", 3, GREY, "level")),
            order=order,
            height=220,
        )

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Redraw when it is time and the rig has told its scene."""
        if rig_state.scene is None or now - self._drawn_at < _PERIOD_S:
            return
        self._drawn_at = now
        strike, struck = rig_state.scene.strike, history.strikes()
        top = top_of(largest([struck[0]]), _ROOM * strike.full_scale_m_per_s)
        if (strike, top) != self._shown:
            self._shown = strike, top
            self._curve = line_of(strike, top)
        self._plot.data = joined((self._curve,), ((struck[0], struck[1]),))

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return (self._plot,)

    def remove(self) -> None:
        """Take it off the page."""
        self._plot.remove()
