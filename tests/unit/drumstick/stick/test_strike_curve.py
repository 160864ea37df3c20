"""The level of a strike: each curve against its closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.drum.calibrate import strike_for_speed, stroke_of
from drumstick.parameters.scene import Scene
from drumstick.parameters.strike import Strike
from drumstick.scenes.scene_text import parse
from drumstick.stick.strike_curve import curve_of, level_at, level_of

POINTS = ((0.1, 0.05), (0.6, 0.4), (0.9, 0.4), (1.5, 0.9))
CURVES = {
    "linear": Strike(),
    "log": Strike("log", 1.8, 0.03),
    "table": Strike("table", 1.5, table=POINTS),
}
speeds = st.floats(0.0, 1000.0)


@given(speed=speeds, full_scale=st.floats(0.01, 20.0))
def test_linear_is_the_speed_over_full_scale_to_the_last_bit(speed: float, full_scale: float) -> None:
    assert level_at(Strike(full_scale_m_per_s=full_scale), speed) == min(speed / full_scale, 1.0)


@given(speed=speeds)
def test_log_gives_equal_steps_of_level_for_equal_steps_in_decibels(speed: float) -> None:
    range_dB = 20.0 * math.log10(1.8 / 0.03)
    above_dB = 20.0 * math.log10(max(speed, 0.03) / 0.03)
    assert level_at(CURVES["log"], speed) == pytest.approx(min(above_dB / range_dB, 1.0), abs=1e-15)


@given(speed=speeds)
def test_a_table_is_straight_between_its_points_and_flat_outside(speed: float) -> None:
    at, levels = zip(*POINTS, strict=True)
    assert level_at(CURVES["table"], speed) == pytest.approx(np.interp(speed, at, levels), abs=1e-15)


@pytest.mark.parametrize("name", CURVES)
@given(level=st.floats(0.0, 1.0))
def test_the_curve_backwards(name: str, level: float) -> None:
    curve = CURVES[name]
    speed = curve.speed_at(level)
    reached = min(max(level, POINTS[0][1]), POINTS[-1][1]) if name == "table" else level
    assert level_at(curve, speed) == pytest.approx(reached, abs=1e-12)
    assert speed == min(speed, curve.speed_at(min(level + 1e-6, 1.0)))


def test_of_several_speeds_with_one_level_the_lowest() -> None:
    assert CURVES["table"].speed_at(0.4) == pytest.approx(0.6)


@pytest.mark.parametrize("name", CURVES)
def test_a_harder_strike_never_has_a_lower_level(name: str) -> None:
    curve = curve_of(CURVES[name])[0]
    levels = [level_of(curve, float(speed)) for speed in np.linspace(0.0, 3.0, 3001)]
    assert np.all(np.diff(levels) >= 0.0)
    assert levels[0] >= 0.0
    assert levels[-1] == CURVES[name].table[-1][1] if name == "table" else 1.0


def mallet_scene(strike: str) -> Scene:
    return parse(f'[drum]\nexcitation = "mallet"\n[strike]\n{strike}\n', "mallet")


def test_a_mallet_has_the_sticks_speed_unless_the_scene_says_which_stroke() -> None:
    assert strike_for_speed(mallet_scene(""), 0.7, 0.5, 0.0).speed_m_per_s == 0.7


def test_a_stroke_goes_from_soft_to_hard_with_the_level() -> None:
    curve = 'curve = "log"\nfull_scale_m_per_s = 1.6\nsoftest_m_per_s = 0.1\n'
    scene = mallet_scene(curve + "stroke_m_per_s = 9.0\nsoft_stroke_m_per_s = 1.0")
    for speed, stroke in ((0.05, 1.0), (0.1, 1.0), (0.2, 3.0), (0.4, 5.0), (1.6, 9.0), (5.0, 9.0)):
        assert stroke_of(scene, speed) == pytest.approx(stroke)
        assert strike_for_speed(scene, speed, 0.5, 0.0).speed_m_per_s == pytest.approx(stroke)
