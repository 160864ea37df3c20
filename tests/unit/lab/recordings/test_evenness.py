"""Evenness of drummers: the judge finds the spread that a made hand has, and neither tempo, accent nor rest counts."""

import numpy as np
import pytest

from drumstick_lab.benchmarks.recordings.evenness import BLOCK, block_of, blocks

_EVERY_S, _DRIFT, _SPREAD_S = 0.2, 0.05, 0.005


def _velocities(rng: np.random.Generator, accent: float) -> np.ndarray:
    number = np.arange(BLOCK + 1)
    return 60.0 * 10.0 ** ((rng.standard_normal(BLOCK + 1) + accent * (number % 4 == 0)) / 20.0)  # 1 dB


def _clock() -> np.ndarray:
    number = np.arange(BLOCK + 1)
    return _EVERY_S * (number + 0.5 * _DRIFT * number**2 / BLOCK)


def test_a_clock_is_even_whatever_its_drift() -> None:
    found = block_of(_clock(), np.full(BLOCK + 1, 64.0))
    assert found.interval_percent == pytest.approx(0.0, abs=1e-9)
    assert found.velocity_dB == pytest.approx(0.0, abs=1e-9)
    assert found.rate_Hz == pytest.approx(1.0 / (_EVERY_S * (1.0 + 0.5 * _DRIFT)), rel=1e-3)


@pytest.mark.parametrize("accent_dB", [0.0, 6.0])
@pytest.mark.parametrize(("kind", "over", "neighbours"), [("intervals", 1.0, -0.13), ("strokes", 1.06, -0.5)])
def test_it_finds_the_spread_and_the_correlation_of_a_made_hand(
    kind: str, over: float, neighbours: float, accent_dB: float
) -> None:
    # Intervals that vary each by itself; or strokes that a clock asks for, each late by itself, whose intervals have
    # little slow power, so that the line takes less of it away than the count of its freedoms says. In so short a
    # block even independent ones correlate a little.
    rng = np.random.default_rng(2)
    found = []
    for _ in range(1000):
        errors = _SPREAD_S * rng.standard_normal(BLOCK + 1)
        times = _clock() + (np.cumsum(errors) if kind == "intervals" else errors / np.sqrt(2.0))
        found.append(block_of(times, _velocities(rng, accent_dB)))
    spread, level = np.sqrt(
        np.mean(np.square([(each.interval_percent, each.velocity_dB) for each in found]), axis=0)
    )
    assert spread == pytest.approx(over * 100.0 * _SPREAD_S / (_EVERY_S * (1.0 + 0.5 * _DRIFT)), rel=0.03)
    assert level == pytest.approx(1.0, rel=0.03)
    assert np.mean([each.neighbours for each in found]) == pytest.approx(neighbours, abs=0.08)


def test_a_rest_ends_a_run_and_no_interval_counts_twice() -> None:
    even = [(0.2 * k, 60) for k in range(2 * BLOCK + 5)]
    assert len(list(blocks(even))) == 2
    rest = [(time + (1.0 if k >= BLOCK else 0.0), velocity) for k, (time, velocity) in enumerate(even)]
    assert len(list(blocks(rest))) == 1  # BLOCK strokes before it have too few intervals
    assert list(blocks(even[:BLOCK])) == []
    assert list(blocks([])) == []
