"""The phase plane: height against speed of a stick thrown into its roll (the paper's Figure 4)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drumstick.scene import Scene
from drumstick.simulate import simulate
from drumstick.trajectory import Trajectory, trajectory
from rig.figures.style import (
    BLUE,
    GREEN,
    HEAD,
    INK,
    ORANGE,
    PURPLE,
    VERMILION,
    legend_below,
    sheet,
    styled,
)

SETTLED_S = 20.0  # of play before the cycle is drawn
CONTACTS = 3  # of each throw
POINTS = 4000
_COLOURS = (ORANGE, PURPLE, VERMILION)
_ENDS = {"captured": ", comes to rest in the head", "left": ", leaves for good", "time": ""}
_MM = 1e3


def thrown_path(scene: Scene, v0_m_per_s: float, contacts: int = CONTACTS) -> tuple[Trajectory, str]:
    """A throw up to the end of its `contacts`-th contact, or until it rests in the head; and how it ended."""
    run = simulate(scene, SETTLED_S, v0_m_per_s)
    if len(run.contacts) >= contacts:
        return trajectory(scene, v0_m_per_s, float(run.contacts[contacts - 1, 2]), POINTS), "time"
    swings = 40.0 * np.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    shown = run.t_end_s + swings if run.end == "captured" else min(run.t_end_s + 1.0, SETTLED_S)
    return trajectory(scene, v0_m_per_s, float(shown), POINTS), run.end


def cycle_path(scene: Scene, v_e_m_per_s: float, period: int) -> Trajectory | None:
    """One turn of the cycle that a throw with its v_E settles on, None when that throw does not go on rolling."""
    run = simulate(scene, SETTLED_S, v_e_m_per_s)
    if run.end != "time" or len(run.contacts) < period + 2:
        return None
    begin, end = run.contacts[-1 - period, 2], run.contacts[-1, 2]
    return trajectory(scene, v_e_m_per_s, float(end - begin), POINTS, float(begin))


def _arrows(axes: Axes, path: Trajectory, colour: str, size: float) -> None:
    # One at each apex: there the path goes straight down, and nothing else is near.
    v, z = path.v_m_per_s, path.z_m * _MM
    for i in np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0) & (z[1:] > 0.0)):
        axes.plot([z[i]], [v[i]], marker="v", ms=size, color=colour, zorder=4)


@styled
def phase_plane(scene: Scene, cycles: Sequence[tuple[float, int]], throws_m_per_s: Sequence[float]) -> Figure:
    """z (mm) against z' (m/s); `cycles` are (v_E, period) of stable cycles, `throws_m_per_s` initial speeds."""
    figure, axes = sheet(
        f"{scene.name}: phase plane", "height of the stick above the head  z  (mm)", "speed  z′  (m/s)"
    )
    for v_e, period in cycles:
        path = cycle_path(scene, v_e, period)
        if path is None:
            continue
        axes.plot(path.z_m * _MM, path.v_m_per_s, color=BLUE, lw=3.0, label="limit cycle", zorder=3)
        _arrows(axes, path, BLUE, 9)
        axes.plot([0.0], [v_e], "D", ms=6.5, mfc="white", mec=BLUE, mew=1.8, zorder=5,
                  label=f"its $v_E$ = {v_e:.3f} m/s, pulse included")  # fmt: skip
    for v0, colour in zip(throws_m_per_s, _COLOURS, strict=False):
        path, end = thrown_path(scene, v0)
        axes.plot(
            path.z_m * _MM, path.v_m_per_s, color=colour, lw=1.1, label=f"thrown at {v0:.3g} m/s{_ENDS[end]}"
        )
        axes.plot([0.0], [v0], "o", ms=4, color=colour)
        _arrows(axes, path, colour, 5)
    low, high = axes.get_xlim()
    top = axes.get_ylim()[1]
    axes.axvspan(low, 0.0, color=HEAD, zorder=0, lw=0, label="in contact with the head")
    axes.set_xlim(low, high)
    axes.axhline(0.0, color=INK, lw=0.6, zorder=1)
    axes.axvline(0.0, color=INK, lw=0.6, zorder=1)
    axes.plot(
        [0.0, 0.0],
        [0.0, top],
        color=GREEN,
        lw=2.2,
        ls=(0, (3, 1.5)),
        zorder=2,
        label="section E: z = 0, z′ > 0",
    )
    axes.set_ylim(top=top)
    legend_below(figure, 2)
    return figure
