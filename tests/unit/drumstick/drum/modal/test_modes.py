"""Zeros and shapes of the membrane's modes, from tables, beside scipy's own."""

import math

import numpy as np
import pytest
from scipy.special import jn_zeros, jv

from drumstick.drum.membrane.lattice import J01
from drumstick.drum.modal.modes import bessel_between, modes_below, radial_shapes


@pytest.mark.parametrize("highest", [0.5, J01, 3.8317, 3.8318, 10.0, 61.7, 200.0])
def test_all_zeros_and_no_other(highest: float) -> None:
    orders = range(math.floor(highest) + 1)
    every = [(float(j), m) for m in orders for j in jn_zeros(m, 2 + math.ceil(highest / 3.0))]
    modes = modes_below(highest)
    wanted = sorted({(J01, 0)} | {(j, m) for j, m in every if J01 + 1e-9 < j <= highest})
    assert [(m, pytest.approx(j, rel=1e-13)) for j, m in wanted] == list(
        zip(modes.orders.tolist(), modes.zeros.tolist(), strict=True)
    )


def test_shapes_from_before_the_middle_to_the_rim() -> None:
    modes = modes_below(150.0)
    radii = np.concatenate([[-0.004, 0.0, 1e-6], np.linspace(0.003, 1.0, 77)])
    # J_m(-x) = (-1)^m J_m(x): a shape goes on as it is.
    exact = jv(modes.orders, np.multiply.outer(radii, modes.zeros))
    assert np.abs(radial_shapes(modes, radii) - exact).max() < 1.2e-6


@pytest.mark.parametrize("order", [0, 1, 2, 33, 63, 64, 100])
def test_one_order_between_the_columns_of_a_close_table(order: int) -> None:
    x = np.geomspace(1e-9, 260.0, 999)
    exact = jv(order, x)
    assert np.abs(bessel_between(order, x) - exact).max() < 4e-9
    assert np.abs(bessel_between(order, x[:700]) - exact[:700]).max() < 4e-9
