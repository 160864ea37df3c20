"""What the roll's speed should be and what it is, over the pulse: equation (7), the kappa prediction, the cycle."""

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from drumstick.scene import Scene
from rig.figures.heading import heading
from rig.figures.style import BLUE, GREY, INK, ORANGE, VERMILION, legend_below, sheet, styled

Speeds = npt.NDArray[np.float64]
_JUMP = 0.2  # of the axis: a line never joins two cycles that have nothing to do with each other


def unjoined(values: Speeds, span: float) -> Speeds:
    """A copy with NaN after each jump of more than a fifth of `span`."""
    apart = values.copy()
    apart[1:][np.abs(np.diff(values)) > _JUMP * span] = np.nan
    return apart


@styled
def predictions(
    scene: Scene,
    dv_m_per_s: Speeds,
    eq7_m_per_s: Speeds,
    kappa_m_per_s: Speeds,
    stable_m_per_s: Speeds,
    unstable_m_per_s: Speeds,
) -> Figure:
    """Arrays of shape (n,), the last two (n, k): up to k cycles per dv, NaN where there is none."""
    figure, axes = sheet(
        heading(scene, "the roll's speed, predicted and measured", {"dv_pls"}),
        "speed that one pulse adds  Δv  (m/s)",
        r"speed of the roll  $v_{lc}$  (m/s)",
    )
    everything = np.concatenate(
        (kappa_m_per_s, stable_m_per_s.ravel(), unstable_m_per_s.ravel(), eq7_m_per_s)
    )
    known = everything[np.isfinite(everything)]
    top = float(known.max()) * 1.05 if known.size else 1.0
    axes.plot(dv_m_per_s, eq7_m_per_s, color=ORANGE, ls=(0, (6, 3)), label="equation (7) as printed")
    axes.plot(
        dv_m_per_s,
        kappa_m_per_s,
        color=VERMILION,
        ls=(0, (6, 2, 1, 2)),
        label="with κ for this trigger and sign",
    )
    for column in range(stable_m_per_s.shape[1]):
        axes.plot(dv_m_per_s, unjoined(stable_m_per_s[:, column], top), color=BLUE, lw=3.2, alpha=0.9, zorder=1,
                  label="the exact cycle, stable" if column == 0 else "")  # fmt: skip
    for column in range(unstable_m_per_s.shape[1]):
        axes.plot(dv_m_per_s, unjoined(unstable_m_per_s[:, column], top), color=BLUE, lw=2.2, ls=":",
                  label="the exact cycle, unstable" if column == 0 else "")  # fmt: skip
    pulse = scene.effects.get("pulse")
    if pulse is not None:
        axes.axvline(
            pulse.dv_m_per_s, color=GREY, lw=1.0, zorder=0, label=f"the scene's Δv = {pulse.dv_m_per_s:g} m/s"
        )
    axes.set_xlim(0.0, float(dv_m_per_s[-1]))
    axes.set_ylim(0.0, top)
    axes.grid(color=INK, alpha=0.08, lw=0.6)
    legend_below(figure, 3)
    return figure
