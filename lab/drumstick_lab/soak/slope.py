"""Slope of Theil and Sen with its confidence interval, and the growth that it shows.

The slope is the median of the slopes between all pairs of samples (Sen 1968): a few wild samples do not move it.
Its interval comes from the variance of Kendall's S; samples that follow each other are alike (a sawtooth, a cache that
fills), which would make the interval too narrow, so that the variance is corrected by the autocorrelation of the
ranks (Hamed and Rao 1998).
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
MAX_SAMPLES = 600  # pairs grow with the square: more samples than this are thinned to their medians
FEWEST = 10
_Z = 1.959963984540054  # 95 %


class Slope(NamedTuple):
    """Units of the quantity per hour; the true slope lies within low .. high with 95 % confidence."""

    per_h: float
    low: float
    high: float

    def times(self, factor: float) -> "Slope":
        """This slope in another unit of the quantity or of time."""
        low, high = sorted((self.low * factor, self.high * factor))
        return Slope(self.per_h * factor, low, high)


def slope_of(hours: Floats, values: Floats) -> Slope:
    """Slope of samples, shape (n,), at times in h that grow. ValueError below ten samples."""
    if len(values) < FEWEST:
        raise ValueError(f"{len(values)} samples: a slope takes at least {FEWEST}")
    hours, values = _thinned(hours, values)
    n = len(values)
    first, second = np.triu_indices(n, 1)
    rises = values[second] - values[first]
    slopes = np.sort(rises / (hours[second] - hours[first]))
    middle = float(np.median(slopes))
    spread = _Z * math.sqrt(_variance_of_s(values) * _correction(values - middle * hours))
    at = (len(slopes) - spread) / 2.0, (len(slopes) + spread) / 2.0
    low = slopes[max(math.floor(at[0]), 0)]
    high = slopes[min(math.ceil(at[1]), len(slopes) - 1)]
    return Slope(middle, float(low), float(high))


def _thinned(hours: Floats, values: Floats) -> tuple[Floats, Floats]:
    together = -(-len(values) // MAX_SAMPLES)
    if together == 1:
        return hours, values
    groups = [slice(i, i + together) for i in range(0, len(values) - together + 1, together)]
    return np.array([np.median(hours[g]) for g in groups]), np.array([np.median(values[g]) for g in groups])


def _variance_of_s(values: Floats) -> float:
    n = len(values)
    ties = np.unique(values, return_counts=True)[1].astype(float)
    return (n * (n - 1) * (2 * n + 5) - float(np.sum(ties * (ties - 1) * (2 * ties + 5)))) / 18.0


def _correction(rest: Floats) -> float:
    # By how much the variance of S is larger than for independent samples; never taken for smaller.
    n = len(rest)
    order = np.unique(rest, return_inverse=True)[1].astype(float)
    ranks = order - order.mean()
    power = float(np.dot(ranks, ranks))
    if power == 0.0:
        return 1.0
    lags = np.arange(1, n // 2)
    alike = np.array([float(np.dot(ranks[:-lag], ranks[lag:])) for lag in lags]) / power
    alike[np.abs(alike) < _Z / math.sqrt(n)] = 0.0
    weights = (n - lags) * (n - lags - 1.0) * (n - lags - 2.0)
    return max(1.0 + 2.0 / (n * (n - 1.0) * (n - 2.0)) * float(np.sum(weights * alike)), 1.0)


class Step(NamedTuple):
    """The one jump that moved a quantity for good: at which time (h), by how much."""

    at_h: float
    by: float


def largest_step(hours: Floats, values: Floats) -> Step:
    """Largest difference of the median of the samples after from that of the five before; 0 where there is none."""
    around = 5
    if len(values) < 2 * around:
        return Step(float(hours[0]), 0.0)
    windows = np.lib.stride_tricks.sliding_window_view(values, around)
    medians = np.median(windows, axis=1)
    jumps = medians[around:] - medians[:-around]
    at = int(np.argmax(np.abs(jumps)))
    return Step(float(hours[at + around]), float(jumps[at]))


def without(hours: Floats, values: Floats, step: Step) -> Floats:
    """The samples as if that jump had not been: a cache that was made once is no leak."""
    return np.where(hours >= step.at_h, values - step.by, values)
