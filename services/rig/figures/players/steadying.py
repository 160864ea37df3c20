"""Figure of a simulated drummer who holds an unstable roll: how late a hand may be."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from drumstick.analysis.steadying import Drummer, share_held, unstable_roll
from drumstick.parameters.scene import Scene
from rig.figures.style import BLUE, GREEN, GREY, HEAD, ORANGE, VERMILION, legend_below, sheet, styled

REACTIONS_S = np.linspace(0.0, 0.3, 31)
HAND_S = (0.1, 0.2)  # reaction time of a hand
TRIES, HELD_S = 40, 20.0
_LINES = ((BLUE, "-"), (GREEN, "-."), (VERMILION, (0, (5, 2))), (ORANGE, (0, (1, 1))))


@styled
def steadying(cases: Sequence[tuple[Scene, float]]) -> Figure:
    """Figure with the share of tries in which an unstable roll is held, over the reaction time: a line for each scene
    and gain, at most four.
    """
    figure, axes = sheet(
        f"an unstable roll, held for {HELD_S:g} s by a grip that answers each strike",
        "reaction time of the drummer  (s)",
        f"share held of {TRIES} tries",
    )
    axes.axvspan(*HAND_S, color=HEAD, lw=0.0, label="reaction time of a hand")
    for (scene, gain), (colour, dashes) in zip(cases, _LINES, strict=False):
        roll = unstable_roll(scene)
        shares = [share_held(scene, roll, Drummer(float(late), gain), TRIES, HELD_S) for late in REACTIONS_S]
        label = f"{scene.name}, {roll.rate_Hz:.0f} Hz, gain {gain:g}"
        axes.plot(REACTIONS_S, shares, color=colour, ls=dashes, label=label)
    axes.axhline(0.0, color=GREY, lw=0.8)
    axes.set_ylim(-0.03, 1.05)
    axes.set_xlim(0.0, float(REACTIONS_S[-1]))
    legend_below(figure, 2)
    return figure
