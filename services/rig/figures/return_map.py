"""The return map: the upward speed after one contact against the speed after the next, with its fixed points."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.return_map import return_map as settled_map
from drumstick.analysis.unpulsed import NEVER_REPEATING
from drumstick.parameters.scene import Scene
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from rig.figures.heading import heading
from rig.figures.style import BLUE, GREY, INK, NO_ROLL, SKY, VERMILION, legend_below, sheet, styled

Speeds = npt.NDArray[np.float64]

POINTS = 600
_PLAYED = 60  # contacts of the throw that is followed
_SLOW = 0.125


class Curves(NamedTuple):
    """Arrays of shape (n,), m/s: a speed at z = 0, rising, and v_E of the next contact, NaN where none comes.

    rolling: contact after contact, where what is left of earlier pulses is what the motion itself reproduces; NaN for
    a motion that never repeats. thrown: the first contact after a throw, without any pulse before it. captured: bool,
    such a throw comes to rest in the head.
    """

    v_e: Speeds
    rolling: Speeds
    thrown: Speeds
    captured: npt.NDArray[np.bool_]


def _next(scene: Scene, v0_m_per_s: float, contacts: int) -> tuple[list[float], int]:
    # v_E of up to so many contacts of a throw, and how it ended.
    law, motion, measured = law_of(scene), thrown(scene, v0_m_per_s), np.zeros(return_step.MEASURED_SIZE)
    speeds: list[float] = []
    outcome = exact.MOVING
    while len(speeds) < contacts and outcome == exact.MOVING:
        outcome = return_step.next_release(law[0], motion[0], return_step.FEW_WAIT_DOUBLINGS, measured)
        if outcome == exact.MOVING:
            speeds.append(float(measured[return_step.V_E]))
    return speeds, outcome


def played(scene: Scene, v0_m_per_s: float) -> Speeds:
    """A throw and v_E of its first contacts, shape (at most 61,)."""
    return np.array([v0_m_per_s, *_next(scene, v0_m_per_s, _PLAYED)[0]])


def example_throw(scene: Scene, mapped: Curves) -> float:
    """A throw that takes many contacts to settle: an eighth of the map's width, if that is not captured."""
    slow = float(mapped.v_e[-1]) * _SLOW
    return slow if np.isfinite(np.interp(slow, mapped.v_e, mapped.thrown)) else scene.hand.throw_m_per_s


def curves(scene: Scene, cycles: Sequence[Cycle]) -> Curves:
    """The map from 0 to twice the fastest cycle, or without one to twice the scene's throw."""
    fastest = max((cycle.v_e_m_per_s for cycle in cycles), default=scene.hand.throw_m_per_s)
    v_e = np.linspace(0.0, 2.0 * fastest, POINTS)
    once = [_next(scene, float(v), 1) for v in v_e]
    after = np.array([speeds[0] if speeds else np.nan for speeds, _ in once])
    captured = np.array([not speeds and outcome != exact.LEFT for speeds, outcome in once])
    repeats = not any(name in scene.effects for name in NEVER_REPEATING)
    rolling = settled_map(scene, v_e) if repeats else np.full(POINTS, np.nan)
    return Curves(v_e, rolling, after, captured)


def _stairs(sequence: Speeds) -> tuple[Speeds, Speeds]:
    # v1 -> v2 -> v3 as steps between the map and the identity line.
    return np.repeat(sequence, 2)[:-1], np.concatenate(([0.0], np.repeat(sequence[1:], 2)))


def _draw_fixed(axes: Axes, cycles: Sequence[Cycle]) -> None:
    for cycle in cycles:
        if cycle.period > 1:
            continue
        inside = INK if cycle.stable else "white"
        v_e, words = cycle.v_e_m_per_s, "stable" if cycle.stable else "unstable"
        axes.plot([v_e], [v_e], "o", ms=8, mec=INK, mfc=inside, mew=1.6, zorder=5, ls="none",
                  label=f"{words}: {v_e:.3f} m/s, multiplier {cycle.multiplier:+.3f}")  # fmt: skip


@styled
def return_map(scene: Scene, mapped: Curves, cycles: Sequence[Cycle], after_throw: Speeds) -> Figure:
    """`after_throw`, shape (n,): a throw and the v_E that follow it, drawn as stairs."""
    figure, axes = sheet(
        heading(scene, "from one contact to the next"),
        r"$v_E$ after a contact  (m/s)", r"$v_E$ after the next contact  (m/s)", 6.6, 6.4,
    )  # fmt: skip
    top = float(mapped.v_e[-1])
    if mapped.captured.any():
        axes.fill_between(
            mapped.v_e, 0.0, 1.0, where=mapped.captured.tolist(), step="mid", transform=axes.get_xaxis_transform(),
            facecolor=NO_ROLL, edgecolor=GREY, hatch="///", lw=0, zorder=0, label="captured when thrown like this",
        )  # fmt: skip
    axes.plot([0.0, top], [0.0, top], color=GREY, lw=1.0, label="no change")
    if np.isfinite(mapped.thrown).any():
        axes.plot(
            mapped.v_e,
            mapped.thrown,
            color=SKY,
            lw=1.6,
            ls=(0, (5, 2)),
            label="the first contact after a throw",
        )
    if np.isfinite(mapped.rolling).any():
        axes.plot(mapped.v_e, mapped.rolling, color=BLUE, lw=2.6, label="contact after contact")
    if len(after_throw) > 1:
        words = f"a throw at {after_throw[0]:.2g} m/s"
        axes.plot(*_stairs(after_throw), color=VERMILION, lw=1.0, label=words)
    _draw_fixed(axes, cycles)
    axes.set_xlim(0.0, top)
    axes.set_ylim(0.0, top)
    axes.set_aspect("equal")
    legend_below(figure, 2)
    return figure
