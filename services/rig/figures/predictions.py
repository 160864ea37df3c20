"""Speed of the roll over the pulse: equation (7), the kappa prediction, and the cycles found."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drumstick.analysis.cycles.fixed_points import fixed_points
from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.analysis.speeds import roll_speeds
from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of
from rig.figures.heading import axis_label, heading, scale_of
from rig.figures.style import BLUE, GREY, INK, ORANGE, VERMILION, legend_below, scaled, sheet, styled

Speeds = npt.NDArray[np.float64]

_MAX_BRANCHES = 6
_JUMP = 0.25  # of a cycle's speed: a line never joins two cycles that have nothing to do with each other


@dataclass(frozen=True)
class Forecast:
    """Speeds of the roll in m/s over dv, shape (n,), NaN where there is none; cycles of period 1: shape (n, 6).

    settled: where the scene's throw ends. stable, unstable: by increasing v_E.
    """

    dv: Speeds
    eq7: Speeds
    kappa: Speeds
    settled: Speeds
    stable: Speeds
    unstable: Speeds


def open_forecast(scene: Scene, dv_m_per_s: Speeds) -> Forecast:
    """The predictions and where throws end; the cycles are still to be filled in. For scenes with [effects.pulse]."""
    speeds = roll_speeds(scene, dv_m_per_s)
    none = np.full((len(dv_m_per_s), _MAX_BRANCHES), np.nan)
    return Forecast(speeds.dv, speeds.eq7, speeds.kappa, speeds.settled, none, none.copy())


def filling(scene: Scene, found: Forecast) -> Iterator[int]:
    """Fill in the cycles of every dv; yields how many are done. Blocks between for some tenths of a second."""
    for i, dv in enumerate(found.dv):
        effects = {**scene.effects, "pulse": replace(scene.effects["pulse"], dv_m_per_s=float(dv))}
        changed = replace(scene, effects=effects)
        cycles = [c for c in fixed_points(law_of(changed), scratch_of(changed)) if c.period == 1]
        for kept, wanted in ((found.stable, True), (found.unstable, False)):
            speeds = [cycle.v_e_m_per_s for cycle in cycles if cycle.stable == wanted][:_MAX_BRANCHES]
            kept[i, : len(speeds)] = speeds
        yield i + 1


def branches(speeds: Speeds) -> list[Speeds]:
    """The columns of (n, k) speeds regrouped into lines, shape (n,): neighbours go on where they change least."""
    lines: list[Speeds] = []
    for i in range(len(speeds)):
        free = list(range(len(lines)))
        for value in speeds[i][np.isfinite(speeds[i])]:
            near = [j for j in free if i > 0 and abs(lines[j][i - 1] - value) <= _JUMP * value]
            if near:
                chosen = min(near, key=lambda j: abs(lines[j][i - 1] - value))
                free.remove(chosen)
            else:
                lines.append(np.full(len(speeds), np.nan))
                chosen = len(lines) - 1
            lines[chosen][i] = value
    return lines


def _draw(axes: Axes, dv: Speeds, speeds: Speeds, line: str, width: float, words: str) -> None:
    lines = branches(speeds)
    for branch in lines:
        alone = np.isfinite(branch).sum() == 1
        axes.plot(dv, branch, color=BLUE, ls=line, lw=width, marker="." if alone else "")
    if lines:
        axes.plot([], [], color=BLUE, ls=line, lw=width, label=words)


@styled
def predictions(scene: Scene, found: Forecast) -> Figure:
    """The three speeds, and the unstable cycles between them, over dv."""
    figure, axes = sheet(
        heading(scene, "the speed of the roll, predicted and measured", {"dv_pls"}),
        axis_label(scene, "dv_pls"),
        r"speed of the roll  $v_{lc}$  (m/s)",
    )
    scale = scale_of(found.dv)
    scaled(axes, "x", scale)
    scaled(axes, "y", scale)
    _draw(axes, found.dv, found.stable, "-", 3.4, "exact motion, stable")
    _draw(axes, found.dv, found.unstable, ":", 2.4, "exact motion, unstable")
    axes.plot(found.dv, found.eq7, color=ORANGE, ls=(0, (6, 3)), label="equation (7) as printed")
    axes.plot(
        found.dv, found.kappa, color=VERMILION, ls=(0, (6, 2, 1, 2)), label="with κ of this trigger and sign"
    )
    own = scene.effects["pulse"].dv_m_per_s
    if found.dv[0] <= own <= found.dv[-1]:
        axes.axvline(own, color=GREY, lw=0.9, ls=":", zorder=0, label=f"this scene: {own:g} m/s")
    axes.set_xlim(float(found.dv[0]), float(found.dv[-1]))
    if scale == "linear":
        axes.set_ylim(bottom=0.0)
    axes.grid(color=INK, alpha=0.08, lw=0.6)
    legend_below(figure, 3)
    return figure
