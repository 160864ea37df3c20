"""Timing of a player's strikes: how far from the beats of a metronome, how even, how fast.

Numbers in, numbers out; any thread. Sources:

- Asynchrony, signed, strike less beat: Repp, "Sensorimotor synchronization: A review of the tapping literature",
  Psychonomic Bulletin & Review 12(6), 2005. Most people are some tens of milliseconds early.
- Lag-1 autocorrelation, timekeeper and motor delay: Wing, Kristofferson, "Response delays and the timing of discrete
  motor responses", Perception & Psychophysics 14(1), 1973. Each interval is one of a timekeeper, plus the delay of the
  strike that ends it, less the delay of the one before: so neighbours correlate by -0.5 .. 0.
- Normalised pairwise variability index: Grabe, Low, "Durational variability in speech and the rhythm class hypothesis",
  Laboratory Phonology 7, 2002.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

Numbers = NDArray[np.float64]
_NONE = -1
_LEAST_S = 1e-9  # between two beats; two strikes may fall together


@dataclass(frozen=True)
class Timing:
    """Measures of one block of strikes; NaN where there are too few strikes for one, or no beats.

    strikes, intervals: how many; odd_intervals: left out of the intervals, since they are less than half or more than
    one and a half of the one that was asked for. misses: beats without a strike; extras: strikes without a beat.
    asynchrony_mean_ms, asynchrony_sd_ms: strike less beat, below 0 is early. interval_mean_ms, interval_sd_ms;
    interval_variation: the second over the first, 1. interval_lag1: autocorrelation of neighbours, 1; npvi: 0 is even.
    rate_Hz: one over the mean interval. timekeeper_sd_ms, motor_sd_ms: the two sources of Wing and Kristofferson, NaN
    where the lag-1 autocorrelation is outside of -0.5 .. 0, which their model cannot have. level_mean, level_variation,
    speed_mean_m_per_s, speed_variation: standard deviation over mean. Standard deviations are of a sample (n - 1).

    >>> import drumstick as ds
    >>> ds.timing([0.0, 0.5], [0.0, 0.5]).misses
    0
    """

    strikes: int
    misses: float
    extras: float
    asynchrony_mean_ms: float
    asynchrony_sd_ms: float
    intervals: int
    odd_intervals: int
    interval_mean_ms: float
    interval_sd_ms: float
    interval_variation: float
    interval_lag1: float
    npvi: float
    rate_Hz: float
    timekeeper_sd_ms: float
    motor_sd_ms: float
    level_mean: float
    level_variation: float
    speed_mean_m_per_s: float
    speed_variation: float


def timing(
    strikes_s: ArrayLike,
    beats_s: ArrayLike = (),
    *,
    interval_s: float | None = None,
    levels: ArrayLike = (),
    speeds_m_per_s: ArrayLike = (),
) -> Timing:
    """Measures of strikes at these times, s, in order; beside `beats_s`, two or more, in order, if there are any.

    `interval_s`: the interval that was asked for, s: those of less than half or more than one and a half of it hide a
    strike that was left out or put in, and are not counted. `levels`, `speeds_m_per_s`: one for each strike. Raises
    ValueError for times that are not finite or not in order, one beat alone, or another number of levels or speeds.

    >>> import drumstick as ds
    >>> block = ds.timing([0.49, 0.98, 1.49], beats_s=[0.5, 1.0, 1.5, 2.0])
    >>> round(block.asynchrony_mean_ms, 1), round(block.interval_mean_ms, 1), block.misses
    (-13.3, 500.0, 1)
    """
    times, beats = _in_order("strikes_s", strikes_s), _in_order("beats_s", beats_s, _LEAST_S)
    if interval_s is not None and not (math.isfinite(interval_s) and interval_s > 0.0):
        raise ValueError(f"interval_s is {interval_s}: give a finite time above 0")
    misses = extras = math.nan
    asynchronies_ms = np.empty(0)
    if len(beats):
        chosen = matched(times, beats)
        hit = chosen != _NONE
        asynchronies_ms = 1e3 * (times[chosen[hit]] - beats[hit])
        misses, extras = int(np.sum(~hit)), len(times) - int(np.sum(hit))
    every_ms = 1e3 * np.diff(times)
    wanted_ms = math.nan if interval_s is None else 1e3 * interval_s
    odd = (every_ms < 0.5 * wanted_ms) | (every_ms > 1.5 * wanted_ms)
    kept_ms = every_ms[~odd]
    pairs_ms = np.stack([every_ms[:-1], every_ms[1:]], axis=1)[~(odd[:-1] | odd[1:])].reshape(-1, 2)
    mean_ms, sd_ms = _mean_and_sd(kept_ms)
    lag1, timekeeper_ms, motor_ms = _lag1(kept_ms, pairs_ms)
    level_mean, level_sd = _mean_and_sd(_one_each("levels", levels, len(times)))
    speed_mean, speed_sd = _mean_and_sd(_one_each("speeds_m_per_s", speeds_m_per_s, len(times)))
    return Timing(
        len(times), misses, extras, *_mean_and_sd(asynchronies_ms), len(kept_ms), int(np.sum(odd)), mean_ms, sd_ms,
        _over(sd_ms, mean_ms), lag1, _npvi(pairs_ms), _over(1e3, mean_ms), timekeeper_ms, motor_ms,
        level_mean, _over(level_sd, level_mean), speed_mean, _over(speed_sd, speed_mean),
    )  # fmt: skip


def matched(strikes_s: ArrayLike, beats_s: ArrayLike) -> NDArray[np.int64]:
    """For each beat the index of its strike, or -1. Times in s and in order; two beats at least, else ValueError.

    The rule: a strike belongs to the beat that it is nearest to, if it is less than half an interval away; of several
    the nearest one is the beat's, and of two equally near ones the earlier. One that falls in the middle between two
    beats belongs to the later one.
    """
    times, beats = _in_order("strikes_s", strikes_s), _in_order("beats_s", beats_s, _LEAST_S)
    if len(beats) < 2:
        raise ValueError("one beat has no interval to match by: give two or more")
    middles = (beats[:-1] + beats[1:]) / 2.0
    edges = np.array([2.0 * beats[0] - middles[0], *middles, 2.0 * beats[-1] - middles[-1]])
    first = np.searchsorted(times, edges)
    chosen = np.full(len(beats), _NONE)
    for k, (begin, end) in enumerate(pairwise(first.tolist())):
        if end > begin:
            chosen[k] = begin + np.argmin(np.abs(times[begin:end] - beats[k]))
    return chosen


def _in_order(name: str, given: ArrayLike, least_s: float = 0.0) -> Numbers:
    times = np.asarray(given, float)
    if times.ndim != 1 or not np.isfinite(times).all() or not (np.diff(times) >= least_s).all():
        raise ValueError(f"{name}: give finite times in order, in s")
    return times


def _one_each(name: str, given: ArrayLike, count: int) -> Numbers:
    values = np.asarray(given, float)
    if values.shape not in ((0,), (count,)):
        raise ValueError(f"{name}: {values.size} values for {count} strikes; give one for each, or none")
    return values


def _mean_and_sd(values: Numbers) -> tuple[float, float]:
    mean = float(np.mean(values)) if len(values) else math.nan
    return mean, float(np.std(values, ddof=1)) if len(values) > 1 else math.nan


def _over(a: float, b: float) -> float:
    return a / b if b else math.nan


def _lag1(kept_ms: Numbers, pairs_ms: Numbers) -> tuple[float, float, float]:
    # Autocorrelation, and the standard deviations of timekeeper and motor delay. Sums are over n, as is usual for
    # autocovariances; where odd intervals are left out, a pair that they break counts for nothing.
    if len(kept_ms) < 3 or not len(pairs_ms):
        return math.nan, math.nan, math.nan
    away = pairs_ms - np.mean(kept_ms)
    gamma0 = float(np.var(kept_ms))
    gamma1 = float(np.sum(away[:, 0] * away[:, 1])) / len(kept_ms)
    if gamma0 <= 0.0:
        return math.nan, math.nan, math.nan
    timekeeper2, motor2 = gamma0 + 2.0 * gamma1, -gamma1
    if timekeeper2 < 0.0 or motor2 < 0.0:
        return gamma1 / gamma0, math.nan, math.nan
    return gamma1 / gamma0, math.sqrt(timekeeper2), math.sqrt(motor2)


def _npvi(pairs_ms: Numbers) -> float:
    if not len(pairs_ms):
        return math.nan
    apart, middle = np.abs(pairs_ms[:, 0] - pairs_ms[:, 1]), np.mean(pairs_ms, axis=1)
    return float(100.0 * np.mean(apart / np.where(middle > 0.0, middle, 1.0)))
