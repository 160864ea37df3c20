"""The picture of the strike's curve."""

import numpy as np
import pytest

from drumstick.parameters.strike import Strike
from drumstick.stick.strike_curve import level_at
from web_panel.views.level import line_of

POINTS = ((0.2, 0.1), (0.5, 0.6), (1.3, 0.9))


@pytest.mark.parametrize(
    "strike", [Strike(), Strike("log", 1.3, 0.05), Strike("table", 1.3, table=POINTS)], ids=lambda s: s.curve
)
def test_the_line_has_the_levels_that_play_and_every_corner(strike: Strike) -> None:
    speeds, levels = line_of(strike, 3.0)
    assert speeds[0] == 0.0
    assert speeds[-1] == 3.0
    assert np.all(np.diff(speeds) > 0.0)
    assert levels.tolist() == [level_at(strike, float(speed)) for speed in speeds]
    corners = {strike.full_scale_m_per_s, *(speed for speed, _ in strike.table)}
    assert corners <= set(speeds.tolist())


def test_corners_beyond_the_right_end_are_left_out() -> None:
    speeds, _ = line_of(Strike(), 1.0)
    assert speeds.max() == 1.0
