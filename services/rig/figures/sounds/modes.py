"""The figure of a drum's modes: the spectrum of one soft strike, and a table beside the ideal membrane's."""

from matplotlib.figure import Figure

from drumstick.drum.measurement.measured_modes import MeasuredMode, MeasuredModes
from rig.figures.style import BLUE, DPI, GREY, WIDTH_IN, styled

_COLUMNS = ["mode m, n", "ideal, Hz", "heard, Hz", "error, cents", "level, dB"]


def _cells(mode: MeasuredMode) -> list[str]:
    found = "-" if mode.found_Hz is None else f"{mode.found_Hz:.2f}"
    cents = "-" if mode.cents is None else f"{mode.cents:+.2f}"
    level = "-" if mode.level_dB is None else f"{mode.level_dB:.1f}"
    return [f"{mode.m}, {mode.n}", f"{mode.ideal_Hz:.2f}", found, cents, level]


@styled
def modes(heard: MeasuredModes, title: str) -> Figure:
    """Lines in the spectrum mark where an ideal membrane of this pitch has its modes."""
    figure = Figure(figsize=(WIDTH_IN, 7.0), dpi=DPI, layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=(1.0, 1.0))
    above.set_title(title)
    above.set_xlabel("frequency, Hz")
    above.set_ylabel("level, dB")
    top_Hz = 1.08 * heard.modes[-1].ideal_Hz
    shown = heard.f_Hz < top_Hz
    for mode in heard.modes:
        above.axvline(mode.ideal_Hz, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))
    above.plot(heard.f_Hz[shown], heard.level_dB[shown], color=BLUE, linewidth=1.0)
    above.set_xlim(0.0, top_Hz)
    above.set_ylim(-100.0, 5.0)
    below.axis("off")
    table = below.table([_cells(mode) for mode in heard.modes], colLabels=_COLUMNS, loc="center")
    table.auto_set_font_size(False)
    table.set_fontsize(9)
    table.scale(1.0, 1.35)
    return figure
