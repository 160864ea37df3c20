"""Errors of a played roll: each measure sees its own fault, and what does not exist is None."""

import math

import numpy as np
import pytest

from drumstick_lab.accuracy.sticks.contacts import (
    AVERAGED,
    COMPARED,
    SETTLED,
    Errors,
    cycle_of,
    errors,
    finite,
    largest_error,
)

COUNT = SETTLED + AVERAGED


def _roll(period_s: float = 0.05, v_e: float = 0.6) -> np.ndarray:
    # t_in, v_in, t_out, v_out, v_E of an even roll.
    t_in = period_s * np.arange(1, COUNT + 1)
    return np.column_stack(
        [t_in, np.full(COUNT, -0.5), t_in + 5e-3, np.full(COUNT, 0.4), np.full(COUNT, v_e)]
    )


def test_an_even_roll_has_its_speed_and_rate() -> None:
    cycle = cycle_of(_roll())
    assert cycle is not None
    assert cycle == pytest.approx((0.6, 20.0), rel=1e-12)


def test_the_throw_does_not_count_for_the_cycle() -> None:
    thrown = _roll()
    thrown[:SETTLED, 4] = 3.0
    assert errors(thrown, _roll()).v_lc == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("found", "wrong"),
    [(_roll(v_e=0.6 * 1.01), (0.0, 0.01, 0.0)), (_roll(period_s=0.05 * 1.01), (0.01, 0.0, 1.0 - 1.0 / 1.01))],
    ids=["speed", "rate"],
)
def test_each_error_is_relative_and_its_own(found: np.ndarray, wrong: tuple[float, ...]) -> None:
    assert errors(found, _roll()) == pytest.approx(wrong, abs=1e-4)


def test_the_largest_error_of_any_instant_or_speed_counts() -> None:
    found = _roll()
    found[COMPARED - 1, 3] *= 1.0 - 1e-3
    assert largest_error(found, _roll()) == pytest.approx(1e-3)
    assert errors(found, _roll()).contacts == pytest.approx(1e-3)
    found = _roll()
    found[COMPARED, 3] *= 2.0
    assert errors(found, _roll()).contacts == 0.0


def test_what_is_missing_is_none() -> None:
    assert errors(_roll()[: COMPARED - 1], _roll()) == Errors(None, None, None)
    assert errors(_roll()[: COUNT - 1], _roll()) == Errors(0.0, None, None)
    grown = _roll()
    grown[-1, 4] = math.inf
    assert errors(grown, _roll()).v_lc is None
    assert [finite(value) for value in (1.5, math.inf, math.nan)] == [1.5, None, None]
