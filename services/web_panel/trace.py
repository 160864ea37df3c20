"""Roll rate and strike speed over the last ten seconds."""

from collections import deque
from typing import Literal

import numpy as np
import viser
import viser.uplot

from web_panel.mirror import Mirror

SPAN_S = 10.0
_PERIOD_S = 0.25
_GREY, _BLUE, _AMBER, _FAINT = "#a9b0ba", "#38a3e0", "#f2b63d", "#33363c"


def _axis(scale: str, side: Literal[1, 2, 3], colour: str) -> viser.uplot.Axis:
    return viser.uplot.Axis(
        scale=scale,
        side=side,
        size=30.0 if scale == "x" else 46.0,
        stroke=colour,
        grid=viser.uplot.Axis_Grid(show=scale != "m/s", stroke=_FAINT, width=1),
        ticks=viser.uplot.Axis_Ticks(stroke=_FAINT, width=1),
    )


class Trace:
    """A plot, drawn four times a second while something is heard. Main thread."""

    def __init__(self, server: viser.ViserServer, order: float) -> None:
        self._points: deque[tuple[float, float, float]] = deque()
        self._drawn_at = float("-inf")
        self._plot = server.gui.add_uplot(
            (np.array([-SPAN_S, 0.0]), np.zeros(2), np.zeros(2)),
            (
                viser.uplot.Series(label="s"),
                viser.uplot.Series(label="roll rate, Hz", scale="Hz", stroke=_BLUE, width=2),
                viser.uplot.Series(label="strike speed, m/s", scale="m/s", stroke=_AMBER, width=2),
            ),
            scales={
                "x": viser.uplot.Scale(time=False, range=(-SPAN_S, 0.0)),
                "Hz": viser.uplot.Scale(range=(0.0, None)),
                "m/s": viser.uplot.Scale(range=(0.0, None)),
            },
            axes=(
                _axis("x", 2, _GREY),
                _axis("Hz", 3, _BLUE),
                _axis("m/s", 1, _AMBER),
            ),
            legend=viser.uplot.Legend(show=True, live=False),
            height=125,
            padding=(8, 8, 0, 0),  # a line at the top of its scale stays whole
            order=order,
        )

    def show(self, mirror: Mirror, now: float) -> None:
        """Take the new states and redraw when it is time."""
        speed = mirror.strike.z_speed_m_per_s if mirror.strike is not None else 0.0
        self._points.extend((at, state.roll_rate_Hz, speed) for at, state in mirror.new_states)
        while self._points and self._points[0][0] < now - SPAN_S:
            self._points.popleft()
        if now - self._drawn_at < _PERIOD_S or len(self._points) < 2:
            return
        self._drawn_at = now
        columns = np.array(self._points).T
        self._plot.data = (np.ascontiguousarray(columns[0] - now), *(c.copy() for c in columns[1:]))
