"""Figures of many times of one thing: the least, and the band of the median."""

import random
import statistics

from drumstick_lab.accuracy.timing import each_in_turn, in_turn, median_band


def test_the_least_of_each_windows_rounds() -> None:
    times = {"one": iter([9.0, 3.0, 1.0, 2.0]), "other": iter([9.0, 5.0, 6.0, 4.0])}
    windows = {name: (lambda own=own: next(own)) for name, own in times.items()}
    assert each_in_turn(windows, 2) == {"one": [3.0, 1.0], "other": [5.0, 6.0]}  # the first is not counted
    again = {name: (lambda: 7.0) for name in windows}
    assert in_turn(again, 3) == {"one": 7.0, "other": 7.0}


def test_the_band_holds_the_median_as_often_as_it_says() -> None:
    """The band of 40 exponential times misses their true median, ln 2, in about one of twenty cases."""
    chance, outside = random.Random(1), 0
    for _ in range(1000):
        low, high = median_band([chance.expovariate(1.0) for _ in range(40)])
        outside += not low <= 0.6931 <= high
    assert 15 < outside < 65


def test_a_band_of_few_times_is_all_of_them() -> None:
    for count in range(1, 7):
        times = [float(k) for k in range(count)]
        assert median_band(times) == (0.0, count - 1.0)
        assert times[0] <= statistics.median(times) <= times[-1]
