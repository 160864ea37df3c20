"""Timing of a player's strikes: each measure against numbers from paper and pencil, the matching against its rule."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import drumstick as ds
from drumstick.analysis.timing import matched

# Intervals of 400, 600, 500, 500 ms: mean 500; deviations -100, 100, 0, 0.
UNEVEN_S = [0.0, 0.4, 1.0, 1.5, 2.0]
TIMES = st.lists(st.integers(0, 4000), unique=True, max_size=40).map(lambda ms: [t / 1e3 for t in sorted(ms)])
BEATS = st.lists(st.integers(0, 4000), unique=True, min_size=2, max_size=30).map(
    lambda ms: [t / 1e3 for t in sorted(ms)]
)


def test_intervals_by_hand() -> None:
    of = ds.timing(UNEVEN_S)
    assert (of.strikes, of.intervals, of.odd_intervals) == (5, 4, 0)
    assert of.interval_mean_ms == pytest.approx(500.0)
    assert of.rate_Hz == pytest.approx(2.0)
    sd_ms = math.sqrt((100.0**2 + 100.0**2) / 3.0)
    assert of.interval_sd_ms == pytest.approx(sd_ms)
    assert of.interval_variation == pytest.approx(sd_ms / 500.0)
    # Products of neighbours -10000, 0, 0; squares 10000, 10000, 0, 0.
    assert of.interval_lag1 == pytest.approx(-0.5)
    # |400 - 600| / 500, |600 - 500| / 550, 0: mean of three, per cent.
    assert of.npvi == pytest.approx(100.0 * (0.4 + 100.0 / 550.0) / 3.0)


def test_timekeeper_and_motor_delay_by_hand() -> None:
    # gamma0 = 20000 / 4 = 5000, gamma1 = -10000 / 4 = -2500: all of it is the motor's.
    of = ds.timing(UNEVEN_S)
    assert (of.timekeeper_sd_ms, of.motor_sd_ms) == pytest.approx((0.0, 50.0), abs=1e-3)
    # Intervals 400, 400, 600, 600: products 10000, -10000, 10000; a positive gamma1 is none of their model's.
    positive = ds.timing([0.0, 0.4, 0.8, 1.4, 2.0])
    assert positive.interval_lag1 == pytest.approx(0.25)
    assert math.isnan(positive.timekeeper_sd_ms)
    assert math.isnan(positive.motor_sd_ms)


def test_the_two_sources_of_wing_and_kristofferson_are_recovered() -> None:
    random = np.random.default_rng(1973)
    delays_s = random.normal(0.05, 0.008, 20_001)
    strikes_s = np.cumsum(random.normal(0.5, 0.02, 20_001)) + delays_s
    of = ds.timing(strikes_s)
    assert of.timekeeper_sd_ms == pytest.approx(20.0, rel=0.03)
    assert of.motor_sd_ms == pytest.approx(8.0, rel=0.1)


def test_asynchrony_misses_and_extras_by_hand() -> None:
    # -10 and -30 ms; a second strike at 520 ms is farther from its beat; the third beat has none; 1.74 has its own.
    of = ds.timing([-0.01, 0.47, 0.54, 1.49, 1.76], [0.0, 0.5, 1.0, 1.5])
    assert (of.misses, of.extras) == (1, 2)
    assert of.asynchrony_mean_ms == pytest.approx(-50.0 / 3.0)
    assert of.asynchrony_sd_ms == pytest.approx(math.sqrt((20 / 3) ** 2 * 2 + (40 / 3) ** 2) / math.sqrt(2.0))


def test_an_interval_that_hides_a_missed_strike_is_left_out() -> None:
    strikes_s = [0.0, 0.5, 1.0, 2.0, 2.5, 2.6, 3.0]
    of = ds.timing(strikes_s, interval_s=0.5)
    assert (of.intervals, of.odd_intervals) == (4, 2)  # 1000 and 100 ms
    assert of.interval_mean_ms == pytest.approx(475.0)
    # Neighbours that both count: the first two alone, for an odd one stands on each side of the others.
    assert of.npvi == 0.0
    assert ds.timing(strikes_s).odd_intervals == 0


def test_levels_and_speeds() -> None:
    of = ds.timing([0.0, 1.0], levels=[0.4, 0.6], speeds_m_per_s=[1.0, 3.0])
    assert (of.level_mean, of.speed_mean_m_per_s) == pytest.approx((0.5, 2.0))
    assert of.level_variation == pytest.approx(math.sqrt(0.02) / 0.5)
    assert of.speed_variation == pytest.approx(math.sqrt(2.0) / 2.0)


@pytest.mark.parametrize("strikes_s", [[], [0.5], [0.5, 0.5, 0.5, 0.5]], ids=["none", "one", "at once"])
def test_too_few_strikes_are_no_error(strikes_s: list[float]) -> None:
    of = ds.timing(strikes_s, [0.0, 1.0])
    assert of.misses == (1 if strikes_s else 2)
    assert math.isnan(of.rate_Hz)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"strikes_s": [1.0, 0.0]}, "strikes_s: give finite times in order"),
        ({"strikes_s": [math.nan]}, "strikes_s: give finite times"),
        ({"strikes_s": [0.0], "beats_s": [1.0, 1.0]}, "beats_s: give finite times in order"),
        ({"strikes_s": [0.0], "beats_s": [1.0]}, "give two or more"),
        ({"strikes_s": [0.0], "interval_s": 0.0}, "interval_s is 0.0"),
        ({"strikes_s": [0.0], "levels": [0.1, 0.2]}, "levels: 2 values for 1 strikes"),
    ],
)
def test_what_is_wrong_is_said(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ds.timing(**arguments)


@given(TIMES, BEATS)
def test_matching_is_one_to_one_and_to_the_nearest(strikes_s: list[float], beats_s: list[float]) -> None:
    chosen = matched(strikes_s, beats_s)
    mine = [k for k in chosen if k >= 0]
    assert len(set(mine)) == len(mine)
    assert sorted(mine) == mine
    for beat, k in enumerate(chosen):
        before = beats_s[max(beat, 1)] - beats_s[max(beat, 1) - 1]
        last = min(beat + 1, len(beats_s) - 1)
        after = beats_s[last] - beats_s[last - 1]
        inside = [
            j for j, t in enumerate(strikes_s)
            if -before / 2.0 + 1e-9 < t - beats_s[beat] < after / 2.0 - 1e-9
        ]  # fmt: skip
        if k < 0:
            assert inside == []
        else:
            away = abs(strikes_s[k] - beats_s[beat])
            assert away <= max(before, after) / 2.0 + 1e-9
            assert all(away <= abs(strikes_s[j] - beats_s[beat]) + 1e-9 for j in inside)


@given(TIMES, BEATS)
def test_every_strike_and_every_beat_is_accounted_for(strikes_s: list[float], beats_s: list[float]) -> None:
    of = ds.timing(strikes_s, beats_s)
    assert len(beats_s) - of.misses == len(strikes_s) - of.extras >= 0


@given(
    st.lists(st.floats(-0.2, 0.2), min_size=2, max_size=30),
    st.sampled_from([0.0, 1e6]),
)
def test_asynchronies_below_half_an_interval_come_back(asynchronies_s: list[float], start_s: float) -> None:
    beats_s = start_s + 0.5 * np.arange(len(asynchronies_s))
    of = ds.timing(beats_s + asynchronies_s, beats_s)
    assert (of.misses, of.extras) == (0, 0)
    assert of.asynchrony_mean_ms == pytest.approx(1e3 * np.mean(asynchronies_s), abs=1e-3)


def test_ties_go_by_the_stated_rule() -> None:
    assert matched([0.5], [0.0, 1.0]).tolist() == [-1, 0]
    assert matched([-0.25, 0.25], [0.0, 1.0]).tolist() == [0, -1]
    assert matched([-0.5, 1.5], [0.0, 1.0]).tolist() == [0, -1]
