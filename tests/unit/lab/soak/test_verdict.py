"""Verdict on growth: a leak is found, noise, a sawtooth and one single jump are none."""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest

from drumstick_lab.soak.slope import slope_of
from drumstick_lab.soak.verdict import of_count, of_growth, unjudged

N, BOUND = 240, 100.0
HOURS = np.arange(N) * 5.0 / 3600.0  # twenty minutes
Floats = npt.NDArray[np.float64]


def noise(random: np.random.Generator, alike: float = 0.7) -> Floats:
    """Memory that wanders: each sample keeps a share of the one before."""
    kicks = random.normal(0.0, 30.0, N)
    wandering = np.zeros(N)
    for i in range(1, N):
        wandering[i] = alike * wandering[i - 1] + kicks[i]
    return 300_000.0 + wandering


def sawtooth(random: np.random.Generator) -> Floats:
    """A pool that fills for some samples and is given back."""
    period = random.uniform(7.0, 25.0)
    return 300_000.0 + 4000.0 * ((np.arange(N) + random.uniform(0.0, period)) % period) / period


def failures(make: Callable[[np.random.Generator], Floats], runs: int = 60) -> int:
    random = np.random.default_rng(2007)
    return sum(not of_growth("rss", "kB", HOURS, make(random), BOUND).passed for _ in range(runs))


def test_what_does_not_leak_passes() -> None:
    assert failures(noise) <= 3  # of 60: the interval is one of 95 %
    assert failures(sawtooth) <= 3
    assert failures(lambda random: noise(random) + 5000.0 * (np.arange(N) > random.integers(70, N - 20))) <= 3


@pytest.mark.parametrize("kb_per_h", [2000.0, 20_000.0])
def test_a_leak_is_found(kb_per_h: float) -> None:
    assert failures(lambda random: noise(random) + kb_per_h * HOURS) >= 57


def test_a_leak_under_a_sawtooth_is_found() -> None:
    assert failures(lambda random: sawtooth(random) + 20_000.0 * HOURS) >= 57


def test_a_leak_in_pages_of_an_arena_is_found() -> None:
    assert failures(lambda random: 3e5 + 256.0 * np.floor(np.arange(N) / 15 + random.uniform())) == 60


def test_one_descriptor_a_minute_is_found_and_a_count_that_comes_and_goes_is_not() -> None:
    leaking = 40.0 + np.floor(HOURS * 60.0)
    verdict = of_growth("descriptors", "descriptors", HOURS, leaking, 1.0)
    assert verdict.passed is False
    assert verdict.slope is not None
    assert verdict.slope.per_h == pytest.approx(60.0, rel=0.05)
    assert of_growth("descriptors", "descriptors", HOURS, 40.0 + np.arange(N) % 3, 1.0).passed


def test_a_single_jump_is_told() -> None:
    verdict = of_growth("rss", "kB", HOURS, 3e5 + 5000.0 * (np.arange(N) >= 150), BOUND)
    assert verdict.passed
    values = 3e5 + 5000.0 * (np.arange(N) >= 150) + np.random.default_rng(1).normal(0.0, 1.0, N)
    jumped = of_growth("rss", "kB", HOURS, values + 20.0 * HOURS, BOUND)
    assert jumped.passed, jumped.words


def test_the_slope_is_the_one_that_was_put_in_whatever_few_samples_say() -> None:
    values = 5.0 + 3.0 * HOURS
    values[::10] += 1000.0
    slope = slope_of(HOURS, values)
    assert slope.per_h == pytest.approx(3.0, rel=0.2)
    assert slope.low <= slope.per_h <= slope.high


def test_the_interval_holds_the_slope_as_often_as_it_says() -> None:
    random = np.random.default_rng(7)
    held = 0
    for _ in range(100):
        slope = slope_of(HOURS, noise(random) + 500.0 * HOURS)
        held += slope.low <= 500.0 <= slope.high
    assert held >= 75, "it says 95: a quantity that wanders slowly is harder than independent samples"


def test_too_few_samples_fail_and_say_so() -> None:
    verdict = of_growth("rss", "kB", HOURS[:8], HOURS[:8], BOUND)
    assert verdict.passed is False
    assert "run it longer" in verdict.words


def test_counts_and_what_is_only_told() -> None:
    assert of_count("gaps", "strikes", 0, 0, "missing").passed
    over = of_count("gaps", "strikes", 2, 0, "missing")
    assert over.passed is False
    assert "at most 0" in over.words
    assert unjudged("xruns", "times", 7, "late blocks").passed is None


@pytest.mark.parametrize(("per_h", "word"), [(0.0, "zero:"), (50.0, "rises, but"), (-50.0, "falls:")])
def test_zero_is_said_only_where_the_interval_holds_it(per_h: float, word: str) -> None:
    grid = np.where(np.arange(N) % 2 == 0, 0.1, -0.1)
    verdict = of_growth("rss", "kB", HOURS, 3e5 + grid + per_h * HOURS, BOUND)
    assert verdict.words.startswith(f"{word} the whole interval is under the bound of 100 ")
