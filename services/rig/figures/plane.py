"""Two parameters at once: the roll's rate as a heat map, and where the stick rolls, buzzes, rests or leaves."""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from drumstick.analysis.cycles.sweep import BUZZ_HZ, BUZZING, CAPTURED, LEFT, STABLE, Swept
from drumstick.parameters.scene import Scene
from rig.figures.heading import axis_label, heading, own_value, scale_of
from rig.figures.style import BUZZ, GREY, HEAT, INK, NO_ROLL, ROLL, WIDTH_IN, scaled, sheet, styled

Grid = npt.NDArray[np.float64]

# Colour and hatch say the same thing twice.
_LOOKS = {
    STABLE: ("steady roll", ROLL, ""),
    BUZZING: (f"buzz: uneven, or over {BUZZ_HZ:g} Hz", BUZZ, "..."),
    CAPTURED: ("captured: rests in the head", NO_ROLL, "///"),
    LEFT: ("leaves for good", "#ffffff", "\\\\\\"),
}
_HEIGHT_IN = 5.2
_CONTOURS = 8


def _region(axes: Axes, x: Grid, y: Grid, there: npt.NDArray[np.bool_], kind: int) -> Patch | None:
    # Colours and hatches the cells that are `there`; returns the entry for the legend, None when there are none.
    if not there.any():
        return None
    words, colour, hatch = _LOOKS[kind]
    cells = np.where(there, 1.0, np.nan)
    axes.pcolormesh(x, y, cells, shading="nearest", cmap=ListedColormap([colour]), rasterized=True)
    if hatch and min(there.shape) > 1:
        axes.contourf(x, y, there.astype(float), levels=[0.5, 1.5], colors="none", hatches=[hatch])
    return Patch(facecolor=colour, edgecolor=GREY, hatch=hatch, lw=0, label=words)


def _open(scene: Scene, swept: Swept, subject: str) -> tuple[Figure, Axes, Grid, Grid]:
    across, up = swept.axes
    swept_names = {across.name, up.name}
    figure, axes = sheet(
        heading(scene, subject, swept_names),
        axis_label(scene, across.name), axis_label(scene, up.name), WIDTH_IN, _HEIGHT_IN,
    )  # fmt: skip
    return figure, axes, across.values, up.values


def _close(scene: Scene, swept: Swept, figure: Figure, axes: Axes, patches: list[Patch | None]) -> None:
    across, up = swept.axes
    scaled(axes, "x", scale_of(across.values))
    scaled(axes, "y", scale_of(up.values))
    axes.set_xlim(float(across.values[0]), float(across.values[-1]))
    axes.set_ylim(float(up.values[0]), float(up.values[-1]))
    x, y = own_value(scene, across.name), own_value(scene, up.name)
    inside = across.values[0] <= x <= across.values[-1] and up.values[0] <= y <= up.values[-1]
    if inside:
        axes.plot([x], [y], "o", ms=8, mfc="white", mec=INK, mew=1.8, ls="none", label="this scene")
    handles = [patch for patch in patches if patch is not None]
    lines, labels = axes.get_legend_handles_labels()
    figure.legend(
        [*handles, *lines], [*(str(patch.get_label()) for patch in handles), *labels],
        loc="outside lower center", ncols=3,
    )  # fmt: skip


@styled
def kinds(scene: Scene, swept: Swept) -> Figure:
    """Map of how a throw ends, over the two axes of `swept`."""
    figure, axes, x, y = _open(scene, swept, "what becomes of a throw")
    patches = [_region(axes, x, y, np.equal(swept.kind.T, kind), kind) for kind in _LOOKS]
    _close(scene, swept, figure, axes, patches)
    return figure


@styled
def rates(scene: Scene, swept: Swept) -> Figure:
    """The roll's rate in Hz, over the two axes of `swept`; hatched where there is no steady roll."""
    figure, axes, x, y = _open(scene, swept, "the roll's rate")
    patches = [_region(axes, x, y, np.equal(swept.kind.T, kind), kind) for kind in (BUZZING, CAPTURED, LEFT)]
    rate = np.where(swept.kind.T == STABLE, swept.rate_Hz.T, np.nan)
    if np.isfinite(rate).any():
        heat = axes.pcolormesh(x, y, rate, shading="nearest", cmap=HEAT, rasterized=True)
        figure.colorbar(heat, ax=axes, label="strikes a second (Hz)", pad=0.02)
        if min(rate.shape) > 1 and np.nanmax(rate) > np.nanmin(rate) * (1.0 + 1e-6):
            lines = axes.contour(x, y, rate, levels=_CONTOURS, colors=INK, linewidths=0.8)
            axes.clabel(lines, fontsize=8.5, fmt="%g")
    _close(scene, swept, figure, axes, patches)
    return figure
