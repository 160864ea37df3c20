"""Just noticeable differences: the published values, and the place where the ear is sharpest."""

import numpy as np
import pytest

from drumstick.drum.membrane.pitch_error import TWENTIETH
from drumstick.perception import jnd


@pytest.mark.parametrize(
    # By the published line, log10 Hz = 0.026 sqrt(f) - 0.533, worked out by hand.
    ("f_Hz", "jnd_Hz"), [(200.0, 0.683), (400.0, 0.970), (1000.0, 1.945), (4000.0, 12.93), (8000.0, 61.9)],
)  # fmt: skip
def test_a_tone_that_much_higher_is_just_told_apart(f_Hz: float, jnd_Hz: float) -> None:
    assert f_Hz * (2.0 ** (jnd.pitch_jnd_cents(f_Hz) / 1200.0) - 1.0) == pytest.approx(jnd_Hz, rel=2e-3)


@pytest.mark.parametrize(("low", "high"), [(20.0, 82.6), (150.0, 620.0), (900.0, 3700.0), (2000.0, 8000.0)])
def test_the_ear_is_sharpest_there(low: float, high: float) -> None:
    at = jnd.sharpest_Hz(low, high)
    assert low <= at <= high
    around = [jnd.pitch_jnd_cents(float(f)) for f in np.geomspace(low, high, 200)]
    assert jnd.pitch_jnd_cents(at) <= min(around) + 1e-9


def test_the_twentieth_mode_is_where_it_is_taken_for() -> None:
    from drumstick.drum.modal.modes import modes_below

    modes = modes_below(12.0)
    pairs = [z for m, z in zip(modes.orders, modes.zeros, strict=True) for _ in range(1 if m == 0 else 2)]
    assert pairs[19] / pairs[0] == pytest.approx(TWENTIETH, rel=1e-9)
