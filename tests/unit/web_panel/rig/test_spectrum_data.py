"""The spectrum as it is drawn, and where an ideal membrane's modes are."""

import numpy as np
import pytest
from scipy.special import jn_zeros

from protocol.messages import Spectrum
from web_panel.rig.spectrum_data import RATIOS, FLOOR_dB, TOP_dB, levels_of, marks


def spectrum(levels: list[float], top_Hz: float = 900.0) -> Spectrum:
    packed = np.array(levels, "<f4").tobytes()
    return Spectrum(id="s", t_ns=0, top_Hz=top_Hz, window_s=0.3, levels=packed)


def test_the_modes_are_those_of_the_ideal_membrane() -> None:
    zeros = sorted(zero for m in range(12) for zero in jn_zeros(m, 8))[: len(RATIOS)]
    assert pytest.approx(np.array(zeros) / zeros[0], abs=1e-4) == RATIOS


def test_levels_stand_at_their_frequencies() -> None:
    f_Hz, levels = levels_of(spectrum([-120.0, -6.0, -30.0, -40.0]))
    assert f_Hz.tolist() == [0.0, 300.0, 600.0, 900.0]
    assert levels == pytest.approx([FLOOR_dB, -6.0, -30.0, -40.0])


@pytest.mark.parametrize(
    "heard",
    [
        spectrum([]),
        spectrum([1.0]),
        spectrum([0.0] * 5000),
        spectrum([float("nan"), 0.0]),
        spectrum([0.0, 0.0], -1.0),
        Spectrum(id="s", t_ns=0, top_Hz=1.0, window_s=1.0, levels=b"\0" * 5),
    ],
)
def test_what_is_no_spectrum_is_a_value_error(heard: Spectrum) -> None:
    with pytest.raises(ValueError):  # noqa: PT011  numpy's own words do as well as ours
        levels_of(heard)


def test_each_mode_below_the_top_is_marked() -> None:
    at, height = marks(150.0, 400.0)
    assert at[height == TOP_dB] == pytest.approx([150.0, 239.0, 320.3, 344.3, 398.0], abs=0.1)
    assert np.all(np.diff(at) >= 0.0)
    assert height[0] == height[-1] == FLOOR_dB
