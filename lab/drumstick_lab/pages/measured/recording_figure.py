"""Figure of a scene's drum beside the recorded one that it was made beside: spectra of the softest, a middle and the hardest stroke."""

from typing import Any

from matplotlib.figure import Figure

from rig.figures.style import BLUE, DPI, VERMILION, WIDTH_IN, scaled, styled

_HEIGHT_IN = 3.0
_FLOOR_DB = -80.0


@styled
def beside_recording(thirds_Hz: list[float], ours: dict[str, Any], real: dict[str, Any], name: str) -> Figure:
    """Levels of thirds of an octave to the whole stroke, dB, over frequency; `ours` and `real` as `beside_recordings` stores them."""
    figure = Figure(figsize=(WIDTH_IN, _HEIGHT_IN), dpi=DPI, layout="constrained")
    panes: Any = figure.subplots(1, 3, sharex=True, sharey=True)
    for axes, place, words in zip(
        panes, (0.0, 0.5, 1.0), ("softest stroke", "middle", "hardest"), strict=True
    ):
        for drum, colour, line, label in (
            (real, VERMILION, "--", f"recorded: {name}"),
            (ours, BLUE, "-", "ours"),
        ):
            strokes = drum["thirds_dB"]
            axes.plot(
                thirds_Hz,
                strokes[round(place * (len(strokes) - 1))],
                color=colour,
                linestyle=line,
                label=label,
                linewidth=1.5,
            )
        axes.set_title(words)
        scaled(axes, "x", "log")
        axes.set_xlim(50.0, 16_000.0)
        axes.set_ylim(_FLOOR_DB, 0.0)
        axes.set_xticks([100.0, 1000.0, 10_000.0], ["100", "1 k", "10 k"])
        axes.grid(visible=True, alpha=0.25)
    panes[0].set_ylabel("level to the whole (dB)")
    panes[1].set_xlabel("frequency, in thirds of an octave (Hz)")
    handles, labels = panes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure
