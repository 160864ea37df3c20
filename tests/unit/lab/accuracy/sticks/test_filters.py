"""Speed filters against their definitions, and the fall by a filter against the servo's own fall."""

import math

import numpy as np
import pytest

from drumstick_lab.accuracy.sticks.falling import Sampled, rebounds
from drumstick_lab.accuracy.sticks.filters import (
    ADAPTIVE,
    FILTERS,
    FIXED_TICKS,
    CUTOFFS_Hz,
    estimated_speeds,
    filter_of,
)
from haptic_server.servo.force.velocity import LONGEST, follow, new_track

T, COUNT_M = 1e-3, 3e-5


def _positions() -> np.ndarray:
    # A wavy path in counts.
    t = T * np.arange(300)
    return np.round(0.01 * np.sin(2.0 * math.pi * 7.0 * t) / COUNT_M) * COUNT_M


@pytest.mark.parametrize("name", FIXED_TICKS)
def test_a_fixed_window_is_the_mean_speed_over_it(name: str) -> None:
    z, ticks = _positions(), FIXED_TICKS[name]
    found = estimated_speeds(name, z, T, COUNT_M)
    np.testing.assert_allclose(found[ticks:], (z[ticks:] - z[:-ticks]) / (ticks * T), rtol=1e-9, atol=1e-12)
    assert found[0] == 0.0


@pytest.mark.parametrize("name", CUTOFFS_Hz)
def test_a_low_pass_weakens_its_cutoff_by_three_decibels(name: str) -> None:
    period_s = 1e-5  # far above the cutoff, where the discrete filter is the continuous one
    w = 2.0 * math.pi * CUTOFFS_Hz[name]
    t = period_s * np.arange(20_000)
    found = estimated_speeds(name, np.sin(w * t) / w, period_s, COUNT_M)
    assert np.max(found[-10_000:]) == pytest.approx(math.sqrt(0.5), rel=0.01)


@pytest.mark.parametrize("name", FILTERS)
def test_an_even_motion_has_its_speed(name: str) -> None:
    z = -0.3 * T * np.arange(400)
    assert estimated_speeds(name, z, T, COUNT_M)[-1] == pytest.approx(-0.3, rel=1e-9)


def test_the_servos_own_is_called_as_it_stands() -> None:
    track, z = new_track(), _positions()
    wanted = [follow(track[0], i * T, float(at), COUNT_M) for i, at in enumerate(z)]
    assert estimated_speeds(ADAPTIVE, z, T, COUNT_M).tolist() == wanted


def test_there_is_no_other_filter() -> None:
    assert max(FIXED_TICKS.values()) < LONGEST  # a track holds no more
    with pytest.raises(KeyError):
        filter_of("average", T)


def test_a_later_filter_gives_more_back() -> None:
    """A late damper pushes on: 15 ticks of window at 1 kHz in a contact of 14."""
    scene = Sampled(3500.0, 1000, 0, "lead").scene()
    means = [
        np.mean(rebounds(scene, False, kind, 8)) for kind in ("difference", "window of 4", "window of 15")
    ]
    assert means[0] < means[1] < means[2]
