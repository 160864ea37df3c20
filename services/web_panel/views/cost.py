"""Cost of the stick, its effects and the drum's mesh now, and of another mesh."""

import statistics
from collections import deque
from collections.abc import Sequence

import viser

from web_panel.rig.history import SPAN_S, PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.rig.view_subscriptions import COST
from web_panel.views import html_tables
from web_panel.views.theory_client import TheoryClient

_PERIOD_S = 0.5
_SOUNDING = 0.25  # of the largest load


def sounding(loads: Sequence[float]) -> tuple[float, float] | None:
    """The load while the drum sounds, its median, and the largest; None of none. At rest a drum costs nothing."""
    if not loads:
        return None
    most = max(loads)
    return statistics.median(load for load in loads if load >= _SOUNDING * most), most


class CostView:
    """Twice a second. Main thread."""

    needs = frozenset({COST})

    def __init__(self, gui: viser.GuiApi, order: float, theorist: TheoryClient) -> None:
        self._theorist = theorist
        self._drawn_at = float("-inf")
        self._loads: deque[tuple[float, float]] = deque()
        self._html = gui.add_html("", order=order)

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Write it anew when it is time."""
        meters = rig_state.living_meters(now)
        if meters:
            self._loads.append((now, meters[0].load))
        while self._loads and self._loads[0][0] < now - SPAN_S:
            self._loads.popleft()
        if now - self._drawn_at < _PERIOD_S:
            return
        self._drawn_at = now
        content = html_tables.cost(
            self._theorist.ticks(rig_state), rig_state.costs, sounding([load for _, load in self._loads])
        )
        if content != self._html.content:
            self._html.content = content

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return ()

    def remove(self) -> None:
        """Take it off the page."""
        self._html.remove()
