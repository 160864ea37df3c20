"""Numbers of the view of accuracy, in units that an axis can write."""

import numpy as np
import pytest

from web_panel.views.accuracy import digits_of


def test_errors_of_the_stick_are_digits_and_its_time_is_in_milliseconds() -> None:
    cost_ms, digits = digits_of((np.array([1e4, 1e9]), np.array([2.0**-52, 1e-3])))
    assert cost_ms.tolist() == [0.01, 1e3]
    assert digits == pytest.approx([15.65, 3.0], abs=0.01)
