"""Figure of what a roll costs: strikes over time, and what each hand and the drum give a second."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from drumstick.analysis.hand_work import HandWork, hand_work
from drumstick.parameters.scene import Scene
from rig.figures.style import BLUE, DPI, GREEN, GREY, HEIGHT_IN, VERMILION, WIDTH_IN, styled

_SHOWN_S = 0.6
_HANDS = ((BLUE, "o"), (VERMILION, "s"))


def _words(scene: Scene, found: HandWork) -> str:
    whose = "two hands, no pulse" if scene.hand.hands == 2 else "one hand, held still"
    return (
        f"{scene.name}: {whose}; {found.rate_Hz:.1f} strikes a second,\nvariation of the intervals "
        f"{100.0 * found.interval_variation:.1f} %, of the speeds {100.0 * found.speed_variation:.1f} %"
    )


@styled
def hands(scenes: Sequence[Scene]) -> Figure:
    """Figure with one row for each scene: its strikes by hand, and mW of each hand and of the drum's pulses."""
    figure = Figure(figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, layout="constrained")
    rows = figure.subplots(len(scenes), 2, squeeze=False, width_ratios=(3.0, 1.0), sharex="col")
    most_mW = 0.0
    for (strikes, power), scene in zip(rows, scenes, strict=True):
        found = hand_work(scene)
        strikes.set_title(_words(scene, found))
        for k, (colour, mark) in enumerate(_HANDS[: len(found.hands_W)]):
            own = found.strikes[(found.strikes[:, 2] == k) & (found.strikes[:, 0] < _SHOWN_S)]
            strikes.vlines(own[:, 0], 0.0, own[:, 1], color=colour, lw=1.2)
            strikes.plot(own[:, 0], own[:, 1], mark, color=colour, ms=5)
        strikes.set_ylim(0.0, None)
        strikes.set_ylabel("strike  (m/s)")
        sources = [f"hand {k + 1}" for k in range(len(found.hands_W))] + ["drum"]
        given_mW = [1e3 * watts for watts in (*found.hands_W, found.drum_W)]
        colours = [colour for colour, _ in _HANDS[: len(found.hands_W)]] + [GREEN]
        power.bar(sources, given_mW, color=colours, width=0.6)
        power.bar_label(power.containers[0], fmt="%.0f", fontsize=9)
        power.set_ylabel("gives  (mW)")
        power.axhline(0.0, color=GREY, lw=0.8)
        power.tick_params(axis="x", labelbottom=True)
        most_mW = max(most_mW, *given_mW)
    for _, power in rows:
        power.set_ylim(0.0, 1.2 * most_mW)
    rows[-1, 0].set_xlabel("time  (s)")
    return figure
