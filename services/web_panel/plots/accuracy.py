"""What accuracy costs: the result that comes with the package beside this machine's own. Main thread."""

from html import escape

import numpy as np
import viser
import viser.uplot

from web_panel.accuracy_results import Files, Result, read
from web_panel.history import History
from web_panel.mirror import Mirror
from web_panel.plots.joined import Pair, joined
from web_panel.plots.look import AMBER, BLUE, GREY, LEGEND, axis, dots

_AGAIN_S = 5.0
_NONE: Pair = (np.empty(0), np.empty(0))
_LOGARITHMIC = 3
_HOW = "This machine has no result of its own yet; to make one, in three minutes, type: drumstick accuracy --quick"


class AccuracyView:
    """Looks for a newer result of this machine every five seconds."""

    needs: frozenset[str] = frozenset()

    def __init__(self, gui: viser.GuiApi, order: float, files: Files) -> None:
        self._files = files
        self._shipped = read(files.shipped)
        self._looked_at = float("-inf")
        self._made: int | None = None
        self._html = gui.add_html("", order=order)
        self._pitch = _plot(gui, order + 0.01, "ns a sample of the drum", "first twenty modes, rms cents")
        self._stick = _plot(gui, order + 0.02, "ns for a second of the stick", "first ten contacts, relative")
        self._draw(None)

    def show(self, mirror: Mirror, history: History, now: float) -> None:
        """Draw anew what was measured since."""
        if now - self._looked_at < _AGAIN_S:
            return
        self._looked_at = now
        made = _made(self._files)
        if made != self._made:
            self._made = made
            self._draw(read(self._files.own))

    def _draw(self, own: Result | None) -> None:
        results = (self._shipped, own)
        told = [("measured for this version", self._shipped), ("this machine", own)]
        lines = [f"{name}: {escape(result.words)}" for name, result in told if result is not None]
        lines += [] if own is not None else [escape(_HOW)]
        self._html.content = '<div class="dr">' + "".join(
            f'<div class="dr-small" data-part="accuracy">{line}</div>' for line in lines
        ) + "</div>"  # fmt: skip
        self._pitch.data = joined((), [_NONE if each is None else each.pitch for each in results])
        self._stick.data = joined((), [_NONE if each is None else each.stick for each in results])

    def remove(self) -> None:
        """Take it off the page."""
        for part in (self._html, self._pitch, self._stick):
            part.remove()


def _made(files: Files) -> int | None:
    try:
        return None if files.own is None else files.own.stat().st_mtime_ns
    except OSError:
        return None


def _plot(gui: viser.GuiApi, order: float, cost: str, error: str) -> viser.GuiUplotHandle:
    scale = viser.uplot.Scale(time=False, distr=_LOGARITHMIC)
    return gui.add_uplot(
        tuple(np.array([1.0, 2.0]) for _ in range(3)),
        (
            viser.uplot.Series(label="costs, ns"),
            dots("measured for this version", "error", BLUE, 6.0),
            dots("this machine", "error", AMBER, 9.0, hollow=True),
        ),
        scales={"x": scale, "error": viser.uplot.Scale(distr=_LOGARITHMIC)},
        axes=(axis("x", 2, GREY, cost), axis("error", 3, GREY, error)),
        legend=LEGEND,
        height=280,
        padding=(8, 16, 0, 0),
        order=order,
    )
