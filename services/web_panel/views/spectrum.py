"""The spectrum of what the drum sounds, with the frequencies of an ideal membrane's modes marked."""

import numpy as np
import viser
import viser.uplot

from protocol.messages import Spectrum
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.rig.spectrum_data import FLOOR_dB, TOP_dB, levels_of, marks
from web_panel.rig.view_subscriptions import SPECTRUM
from web_panel.views.plot_data import joined
from web_panel.views.plot_style import AMBER, BLUE, FAINT, GREY, Missing, axis, blank, dots, line, plot

_PERIOD_S = 0.2


class SpectrumView:
    """Four times a second, from the sound server's own output of this drum. Main thread."""

    needs = frozenset({SPECTRUM})

    def __init__(self, gui: viser.GuiApi, order: float) -> None:
        self._drawn: Spectrum | None = None
        self._drawn_at = float("-inf")
        self._missing = Missing(gui, order)
        series = (
            viser.uplot.Series(label="frequency, Hz"),
            line("ideal membrane’s modes", "dB", FAINT, 1.5),
            line("heard", "dB", BLUE, 1.5),
            dots("f01", "dB", AMBER, 9.0),
        )
        self._blank = blank(len(series))
        self._plot = plot(
            gui,
            series,
            scales={"x": viser.uplot.Scale(time=False), "dB": viser.uplot.Scale(range=(FLOOR_dB, TOP_dB))},
            axes=(axis("x", 2, GREY, "frequency, Hz"), axis("dB", 3, GREY, "level, dB of full scale")),
            order=order + 0.01,
        )

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Redraw when something new was heard."""
        heard, scene = rig_state.spectrum, rig_state.scene
        self._missing.say("" if heard is not None else "No sound server reports a spectrum.")
        if heard is None and self._drawn is not None:
            self._drawn = None
            self._plot.data = self._blank
        if heard is None or heard is self._drawn or scene is None or now - self._drawn_at < _PERIOD_S:
            return
        self._drawn, self._drawn_at = heard, now
        f_Hz, levels = levels_of(heard)
        f01_Hz = scene.drum.f01_Hz
        own = np.array([f01_Hz]), np.interp([f01_Hz], f_Hz, levels)
        self._plot.data = joined((marks(f01_Hz, heard.top_Hz), (f_Hz, levels)), (own,))

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return (self._plot,)

    def remove(self) -> None:
        """Take it off the page."""
        self._missing.remove()
        self._plot.remove()
