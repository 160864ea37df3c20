"""Several curves on one abscissa, without inventing anything."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from web_panel.views.plot_data import csv_text, joined, largest, top_of

NONE = (np.empty(0), np.empty(0))


def test_lines_are_drawn_on_and_dots_stay_where_they_are() -> None:
    line = np.array([0.0, 2.0]), np.array([0.0, 4.0])
    dots = np.array([3.0, 1.0]), np.array([7.0, 8.0])
    x, drawn, dotted = joined((line,), (dots,))
    assert x.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert drawn == pytest.approx([0.0, 2.0, 4.0, np.nan], nan_ok=True)
    assert dotted == pytest.approx([np.nan, 8.0, np.nan, 7.0], nan_ok=True)


def test_an_upright_line_of_dots_keeps_both_its_ends() -> None:
    x, dotted = joined((), ((np.zeros(2), np.array([0.0, 0.5])),))
    assert x.tolist() == [0.0, 0.0]
    assert dotted.tolist() == [0.0, 0.5]


def test_nothing_is_drawn_of_nothing() -> None:
    x, line, dots = joined((NONE,), (NONE,))
    assert len(x) == len(line) == len(dots) == 0


@given(st.floats(1e-6, 1e6), st.floats(1e-3, 10.0))
def test_the_end_of_a_scale_has_room_but_not_much(value: float, least: float) -> None:
    top = top_of(value, least)
    assert max(value, least) <= 1.000001 * top
    assert top <= 2.0 * max(value, least)


def test_the_end_of_a_scale_without_numbers() -> None:
    assert top_of(float("nan"), 0.1) == pytest.approx(0.1)
    assert largest([np.empty(0)]) == 0.0
    assert largest([np.empty(0), np.array([0.2, 0.7])]) == 0.7


def test_csv_has_names_that_hold_commas_and_empty_cells_where_there_is_no_value() -> None:
    columns = np.array([-1.0, 0.0]), np.array([math.nan, 23.05])
    assert csv_text(("time, s", "rate, Hz"), columns) == b'"time, s","rate, Hz"\r\n-1,\r\n0,23.05\r\n'
