"""The phase plane: height against speed of a stick thrown into its roll (the paper's Figure 4)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.return_step import scratch_of
from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of
from drumstick.stick.simulate import simulate
from drumstick.stick.trajectory import Trajectory, onward, trajectory
from rig.figures.heading import heading
from rig.figures.style import BLUE, GREEN, HEAD, INK, ORANGE, PURPLE, VERMILION, legend_below, sheet, styled

MAX_S = 10.0
CONTACTS = 3  # of each throw
POINTS = 4000
_COLOURS = (ORANGE, PURPLE, VERMILION)
_ENDS = {"captured": ", comes to rest in the head", "left": ", leaves for good", "time": ""}
_SWINGS = 40.0  # radians in the head after which a captured stick is shown at rest
_MM = 1e3


def thrown_path(scene: Scene, v0_m_per_s: float) -> tuple[Trajectory, str]:
    """A throw up to the end of its third contact, or until it rests in the head; and how it ended."""
    run = simulate(scene, MAX_S, v0_m_per_s)
    if len(run.contacts) >= CONTACTS:
        return trajectory(scene, v0_m_per_s, float(run.contacts[CONTACTS - 1, 2]), POINTS), "time"
    swings_s = _SWINGS * np.sqrt(scene.stick.m_kg / scene.stick.k_coll_N_per_m)
    shown_s = run.t_end_s + swings_s if run.end == "captured" else min(run.t_end_s + 1.0, MAX_S)
    return trajectory(scene, v0_m_per_s, float(shown_s), POINTS), run.end


def cycle_path(scene: Scene, cycle: Cycle) -> Trajectory:
    """Once around the cycle, stable or not, from its own state at z = 0 on the way up."""
    law, scratch = law_of(scene), scratch_of(scene)
    return_step.set_state(law[0], scratch[1:], scratch[:1], cycle.states[-1])
    return onward(law, scratch[:1], cycle.period / cycle.rate_Hz, POINTS)


def _arrows(axes: Axes, path: Trajectory, colour: str, size: float) -> None:
    # One at each apex: there the path goes straight down, and nothing else is near.
    v, z = path.v_m_per_s, path.z_m * _MM
    for i in np.flatnonzero((v[:-1] > 0.0) & (v[1:] <= 0.0) & (z[1:] > 0.0)):
        axes.plot([z[i]], [v[i]], marker="v", ms=size, color=colour, zorder=4)


def _draw_cycle(axes: Axes, scene: Scene, cycle: Cycle) -> None:
    path = cycle_path(scene, cycle)
    line, words = ("-", "limit cycle") if cycle.stable else (":", "unstable cycle")
    axes.plot(path.z_m * _MM, path.v_m_per_s, color=BLUE, lw=3.0, ls=line, label=words, zorder=3)
    _arrows(axes, path, BLUE, 9)
    axes.plot([0.0], [cycle.v_e_m_per_s], "D", ms=6.5, mfc="white", mec=BLUE, mew=1.8, zorder=5, ls="none",
              label=f"its $v_E$ = {cycle.v_e_m_per_s:.3f} m/s, pulse included")  # fmt: skip


def _draw_places(axes: Axes) -> None:
    low, high = axes.get_xlim()
    bottom, top = axes.get_ylim()
    axes.axvspan(low, 0.0, color=HEAD, zorder=0, lw=0, label="in contact with the head")
    axes.axhline(0.0, color=INK, lw=0.6, zorder=1)
    axes.axvline(0.0, color=INK, lw=0.6, zorder=1)
    axes.plot([0.0, 0.0], [0.0, top], color=GREEN, lw=2.2, ls=(0, (3, 1.5)), zorder=2,
              label="section E: z = 0, z′ > 0")  # fmt: skip
    axes.set_xlim(low, high)
    axes.set_ylim(bottom, top)


@styled
def phase_plane(scene: Scene, cycles: Sequence[Cycle], throws_m_per_s: Sequence[float]) -> Figure:
    """z (mm) against z' (m/s): these cycles, and up to three throws with these speeds."""
    figure, axes = sheet(
        heading(scene, "phase plane"), "height of the stick above the head  z  (mm)", "speed  z′  (m/s)"
    )
    for cycle in cycles:
        _draw_cycle(axes, scene, cycle)
    for v0, colour in zip(throws_m_per_s, _COLOURS, strict=False):
        path, end = thrown_path(scene, v0)
        words = f"thrown at {v0:.2g} m/s{_ENDS[end]}"
        axes.plot(path.z_m * _MM, path.v_m_per_s, color=colour, lw=1.1, label=words)
        axes.plot([0.0], [v0], "o", ms=4, color=colour)
        _arrows(axes, path, colour, 5)
    _draw_places(axes)
    legend_below(figure, 2)
    return figure
