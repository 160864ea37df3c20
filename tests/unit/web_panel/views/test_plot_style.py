"""A plot that waits for its data shows none."""

from unittest.mock import Mock

import numpy as np
import viser.uplot

from web_panel.views.plot_style import BLUE, line, plot


def test_a_plot_that_waits_draws_nothing() -> None:
    gui = Mock()
    series = (viser.uplot.Series(label="Hz"), line("heard", "dB", BLUE, 1.5), line("modes", "dB", BLUE, 1.5))
    plot(gui, series, scales={}, axes=(), order=1.0)
    abscissa, *columns = gui.add_uplot.call_args.args[0]
    assert len(abscissa) == 2, "uPlot wants two points"
    assert (abscissa > 0.0).all(), "or none could be on a logarithmic scale"
    assert len(columns) == 2
    assert np.isnan(columns).all()
