"""Bifurcation diagram of a roll over one parameter, and its rate: one point if steady, a few or a cloud for a buzz."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drumstick.analysis.cycles.sweep import MEASURED, Swept
from drumstick.parameters.scene import Scene
from rig.figures.heading import axis_label, heading, own_value, scale_of
from rig.figures.style import BLUE, DPI, GREY, INK, NO_ROLL, WIDTH_IN, legend_below, scaled, styled

_HEIGHT_IN = 5.6
_WIDE = 300.0  # speeds that differ by more than this factor are drawn on a logarithmic axis


def _shade_rest(axes: Axes, swept: Swept, label: str) -> None:
    resting = ~np.isfinite(swept.rate_Hz)
    if resting.any():
        axes.fill_between(
            swept.axes[0].values, 0.0, 1.0, where=resting.tolist(), step="mid",
            transform=axes.get_xaxis_transform(),
            facecolor=NO_ROLL, edgecolor=GREY, hatch="///", lw=0, zorder=0, label=label,
        )  # fmt: skip


@styled
def bifurcation(scene: Scene, swept: Swept) -> Figure:
    """v_E of the last contacts, and strikes a second, over the one axis of `swept`."""
    axis = swept.axes[0]
    figure = Figure(figsize=(WIDTH_IN, _HEIGHT_IN), dpi=DPI, layout="constrained")
    speeds = figure.add_subplot(3, 1, (1, 2))
    rates = figure.add_subplot(3, 1, 3, sharex=speeds)
    speeds.set_title(heading(scene, "where the roll ends up", {axis.name}))
    scaled(speeds, "x", scale_of(axis.values))
    every = np.repeat(axis.values, MEASURED)
    speeds.plot(every, swept.v_e_m_per_s.ravel(), ".", ms=3, mew=0, color=BLUE, rasterized=True)
    known = swept.v_e_m_per_s[swept.v_e_m_per_s > 0.0]
    wide = known.size > 0 and float(known.max()) > _WIDE * float(known.min())
    scaled(speeds, "y", "log" if wide else "linear")
    speeds.set_ylabel(rf"last {MEASURED} speeds  $v_E$  (m/s)")
    rates.plot(axis.values, swept.rate_Hz, ".", ms=3, mew=0, color=BLUE)
    rates.set_ylabel("strikes a\nsecond (Hz)")
    rates.set_xlabel(axis_label(scene, axis.name))
    speeds.tick_params(labelbottom=False)
    own = own_value(scene, axis.name)
    for axes, said in ((speeds, True), (rates, False)):
        axes.set_xlim(float(axis.values[0]), float(axis.values[-1]))
        if axes is rates or not wide:
            axes.set_ylim(bottom=0.0)
        _shade_rest(axes, swept, "no roll: rests in the head, or leaves" if said else "")
        if axis.values[0] <= own <= axis.values[-1]:
            axes.axvline(own, color=INK, lw=0.9, ls=":", label=f"this scene: {own:g}" if said else "")
    if speeds.get_legend_handles_labels()[1]:
        legend_below(figure, 2)
    return figure
