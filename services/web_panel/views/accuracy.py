"""Cost of accuracy: the result that comes with the package beside this machine's own. Main thread."""

from html import escape
from pathlib import Path

import numpy as np
import viser
import viser.uplot

from web_panel.accuracy_results import Files, Result, read
from web_panel.rig.history import PlotHistory
from web_panel.rig.rig_state import RigState
from web_panel.views.plot_data import Pair, joined
from web_panel.views.plot_style import AMBER, BLUE, GREY, axis, dots, plot

_AGAIN_S = 5.0
_NONE: Pair = (np.empty(0), np.empty(0))
_LOGARITHMIC = 3
_MOST_DIGITS = 16.0  # of a double
_HOW = "This machine has no result of its own yet; to make one, in three minutes, type: drumstick accuracy --quick"


def digits_of(stick: Pair) -> Pair:
    """CPU time (ms) and correct decimal digits of the stick, from CPU time (ns) and relative errors, shape (n,) each.

    uPlot writes three decimals: numbers at a logarithmic axis from 1e-12 to 1 would be zeros.
    """
    cost_ns, error = stick
    return cost_ns / 1e6, -np.log10(error)


class AccuracyView:
    """Looks for a newer result of this machine every five seconds."""

    needs: frozenset[str] = frozenset()

    def __init__(self, gui: viser.GuiApi, order: float, files: Files) -> None:
        self._files = files
        self._shipped, self._shipped_words = _read(files.shipped, "")
        self._looked_at = float("-inf")
        self._made: int | None = None
        self._html = gui.add_html("", order=order)
        self._pitch = _plot(
            gui,
            order + 0.01,
            "CPU time per sample of the drum (ns)",
            "first twenty modes, rms cents",
            viser.uplot.Scale(distr=_LOGARITHMIC),
        )
        self._stick = _plot(
            gui,
            order + 0.02,
            "CPU time per second of the stick (ms)",
            "first ten contacts, correct digits",
            viser.uplot.Scale(range=(0.0, _MOST_DIGITS)),
        )
        self._draw(None, _HOW)

    def show(self, rig_state: RigState, history: PlotHistory, now: float) -> None:
        """Draw anew what was measured since."""
        if now - self._looked_at < _AGAIN_S:
            return
        self._looked_at = now
        made = _made(self._files)
        if made != self._made:
            self._made = made
            self._draw(*_read(self._files.own, _HOW))

    def _draw(self, own: Result | None, missing: str) -> None:
        results = (self._shipped, own)
        named = [("measured for this version", self._shipped), ("this machine", own)]
        lines = [f"{name}: {escape(result.words)}" for name, result in named if result is not None]
        lines += [escape(words) for words in (self._shipped_words, missing) if words]
        self._html.content = '<div class="dr">' + "".join(
            f'<div class="dr-small" data-part="accuracy">{line}</div>' for line in lines
        ) + "</div>"  # fmt: skip
        self._pitch.data = joined((), [_NONE if each is None else each.pitch for each in results])
        self._stick.data = joined((), [_NONE if each is None else digits_of(each.stick) for each in results])

    @property
    def plots(self) -> tuple[viser.GuiUplotHandle, ...]:
        """See View."""
        return self._pitch, self._stick

    def remove(self) -> None:
        """Take it off the page."""
        for part in (self._html, self._pitch, self._stick):
            part.remove()


def _read(path: Path | None, missing: str) -> tuple[Result | None, str]:
    # The result, or what to say instead of it.
    try:
        found = read(path)
    except ValueError as error:
        return None, f"{str(error)[:300]}. To make a new one, type: drumstick accuracy --quick"
    return found, "" if found is not None else missing


def _made(files: Files) -> int | None:
    try:
        return None if files.own is None else files.own.stat().st_mtime_ns
    except OSError:
        return None


def _plot(
    gui: viser.GuiApi, order: float, cost: str, error: str, scale: viser.uplot.Scale
) -> viser.GuiUplotHandle:
    return plot(
        gui,
        (
            viser.uplot.Series(label="CPU time"),
            dots("measured for this version", "error", BLUE, 6.0),
            dots("this machine", "error", AMBER, 9.0, hollow=True),
        ),
        scales={"x": viser.uplot.Scale(time=False, distr=_LOGARITHMIC), "error": scale},
        axes=(axis("x", 2, GREY, cost), axis("error", 3, GREY, error)),
        order=order,
        height=280,
    )
