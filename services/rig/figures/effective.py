"""Figure of beta^(v): what a blow is given back with every effect in it, by its speed (the paper's section 4.2)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from drumstick.analysis.effective import effective_restitution
from drumstick.analysis.rebound import rebound
from drumstick.parameters.scene import Scene
from rig.figures.heading import effect_words, heading
from rig.figures.style import BLUE, GREEN, GREY, ORANGE, VERMILION, legend_below, scaled, sheet, styled

Numbers = npt.NDArray[np.float64]

_SLOWEST_M_PER_S, _FASTEST_M_PER_S, _POINTS = 0.03, 5.0, 200
_LINES = ((BLUE, "-"), (VERMILION, (0, (5, 2))), (GREEN, (0, (1, 1))), (ORANGE, "-."))
_TOP = 3.0  # a pulse of fixed dv makes endlessly much of a blow that is next to nothing


class Restitution(NamedTuple):
    """Arrays of shape (n,): entry speed m/s, beta^ with all effects, beta without pulses; NaN where the stick stays."""

    v: Numbers
    effective: Numbers
    unpulsed: Numbers


def restitution(scene: Scene) -> Restitution:
    """Restitutions beta^ and beta of the scene, from 0.03 to 5 m/s."""
    v = np.geomspace(_SLOWEST_M_PER_S, _FASTEST_M_PER_S, _POINTS)
    struck = [rebound(scene, float(speed)) for speed in v]
    unpulsed = np.array([np.nan if each is None else each.beta for each in struck])
    return Restitution(v, effective_restitution(scene, v), unpulsed)


@styled
def effective(scenes: Sequence[Scene]) -> Figure:
    """Figure with one line a scene, at most four, and what the first one's head gives back without pulses."""
    title = heading(scenes[0], "what a blow is given back")
    if len(scenes) > 1:
        title = "what a blow is given back with all effects in it"
    figure, axes = sheet(
        title, r"$|v_\mathrm{in}|$ of the blow  (m/s)", r"$\hat\beta = v_E / |v_\mathrm{in}|$"
    )
    first = restitution(scenes[0])
    axes.axhline(1.0, color=GREY, lw=0.8)
    for scene, (colour, dashes) in zip(scenes, _LINES, strict=False):
        found = restitution(scene).effective if scene is not scenes[0] else first.effective
        axes.plot(first.v, found, color=colour, ls=dashes, label=f"{scene.name}: {effect_words(scene)}")
    axes.plot(first.v, first.unpulsed, color=GREY, lw=1.4, label=f"{scenes[0].name} without pulses")
    scaled(axes, "x", "log")
    axes.set_ylim(
        0.0, min(_TOP, float(np.nanmax([*first.effective, 1.0])) * 1.1) if len(scenes) == 1 else _TOP
    )
    legend_below(figure, 1)
    return figure
