"""The return map: the upward speed after one contact against the speed after the next, with its fixed points."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from drumstick.scene import Scene
from rig.figures.heading import heading
from rig.figures.style import BLUE, GREY, INK, NO_ROLL, VERMILION, legend_below, sheet, styled

Speeds = npt.NDArray[np.float64]


class Curve(NamedTuple):
    """The map: v_E, shape (n,), rising, and the next v_E, NaN where no next contact comes; m/s."""

    v_e: Speeds
    after: Speeds


def _stairs(sequence: Speeds) -> tuple[Speeds, Speeds]:
    # v1 -> v2 -> v3 as steps between the map and the identity line.
    x = np.repeat(sequence, 2)[:-1]
    y = np.concatenate(([0.0], np.repeat(sequence[1:], 2)))
    return x, y


@styled
def return_map(
    scene: Scene,
    curve: Curve,
    fixed: Sequence[tuple[float, float]],
    capture_m_per_s: float | None,
    played: Speeds,
) -> Figure:
    """`fixed` are (v_E, multiplier); `played`, shape (m,), are the v_E that follow a throw, drawn as stairs."""
    figure, axes = sheet(
        heading(scene, "from one contact to the next"),
        r"$v_E$ after a contact  (m/s)",
        r"$v_E$ after the next contact  (m/s)",
        6.2, 5.8,
    )  # fmt: skip
    top = float(curve.v_e[-1])
    if capture_m_per_s is not None and capture_m_per_s > 0.0:
        axes.axvspan(
            0.0, min(capture_m_per_s, top), facecolor=NO_ROLL, edgecolor=GREY, hatch="///", lw=0, zorder=0,
            label=f"a throw below {capture_m_per_s:.3g} m/s is captured",
        )  # fmt: skip
    axes.plot([0.0, top], [0.0, top], color=GREY, lw=1.0, label="no change")
    if np.isfinite(curve.after).any():
        axes.plot(curve.v_e, curve.after, color=BLUE, lw=2.4, label="exact map")
    if len(played) > 1:
        axes.plot(
            *_stairs(played),
            color=VERMILION,
            lw=1.0,
            label=f"after a throw at {scene.hand.throw_m_per_s:g} m/s",
        )
    for v_e, multiplier in fixed:
        stable = abs(multiplier) < 1.0
        words = f"{'stable' if stable else 'unstable'}: {v_e:.3f} m/s, multiplier {multiplier:+.3f}"
        axes.plot(
            [v_e],
            [v_e],
            "o",
            ms=8,
            mec=INK,
            mfc=INK if stable else "white",
            mew=1.6,
            zorder=5,
            ls="none",
            label=words,
        )
    axes.set_xlim(0.0, top)
    axes.set_ylim(0.0, top)
    axes.set_aspect("equal")
    legend_below(figure, 2)
    return figure
