"""Health of the rig: connections, effect of the network on strikes, their accuracy, lateness of the force loop."""

from collections.abc import Callable, Mapping
from typing import Any, cast

import numpy as np
import viser
import viser.uplot

from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.rig.view_subscriptions import DOCTOR, RELEASES
from web_panel.views import html_tables
from web_panel.views.plot_data import Numbers, Pair
from web_panel.views.plot_style import BLUE, GREY, axis, plot

_PERIOD_S = 0.5
_MAX_BINS = 4096
_DAY_PX = 80.0  # room for 100,000,000, the ticks of a day
_FILL = "rgba(56,163,224,.25)"


def lateness_of(doctor: Mapping[str, Any] | None) -> Pair | None:
    """Lateness (us) and how many ticks were so late, shape (n,), NaN where none was; None where nothing is told."""
    lateness: object = (doctor or {}).get("lateness")
    if not isinstance(lateness, dict):
        return None
    given = cast(dict[str, object], lateness)
    bin_us, ticks = given.get("bin_us"), given.get("ticks")
    if not isinstance(bin_us, int | float) or not isinstance(ticks, list):
        return None
    counts = cast(list[object], ticks)[:_MAX_BINS]
    if len(counts) < 2 or not all(isinstance(count, int) and count >= 0 for count in counts):
        return None
    found = np.array(counts, np.float64)
    found[found == 0.0] = np.nan
    late_us: Numbers = (np.arange(len(found), dtype=np.float64) + 0.5) * float(bin_us)
    return late_us, found


class HealthView:
    """Twice a second; the haptic server is asked every two seconds. Main thread."""

    needs = frozenset({DOCTOR, RELEASES})

    def __init__(self, gui: viser.GuiApi, order: float, browsers: Callable[[], int]) -> None:
        self._browsers = browsers
        self._drawn_at = float("-inf")
        self._doctor: Mapping[str, Any] | None = None
        self._html = gui.add_html("", order=order)
        self._plot = plot(
            gui,
            (
                viser.uplot.Series(label="lateness, µs"),
                viser.uplot.Series(label="lateness histogram", scale="ticks", stroke=BLUE, width=2, fill=_FILL),
            ),
            scales={"x": viser.uplot.Scale(time=False), "ticks": viser.uplot.Scale(distr=3)},
            axes=(
                axis("x", 2, GREY, "lateness of a tick, µs"),
                axis("ticks", 3, GREY, "number of ticks (log)", _DAY_PX),
            ),
            order=order + 0.1,
            height=220,
        )  # fmt: skip

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Write it anew when it is time."""
        if now - self._drawn_at < _PERIOD_S:
            return
        self._drawn_at = now
        content = html_tables.health(
            rig_state.living_meters(now),
            rig_state.present,
            self._browsers(),
            rig_state.doctor,
            rig_state.state,
            rig_state.announcements.report(),
        )
        if content != self._html.content:
            self._html.content = content
        if rig_state.doctor is not self._doctor:
            self._doctor = rig_state.doctor
            if (found := lateness_of(rig_state.doctor)) is not None:
                self._plot.data = found

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return (self._plot,)

    def remove(self) -> None:
        """Take it off the page."""
        self._html.remove()
        self._plot.remove()
