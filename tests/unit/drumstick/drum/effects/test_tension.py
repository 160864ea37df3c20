"""The pull of one step in closed form, against a search by halves in arbitrary precision; what a table may ask for."""

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from drumstick.drum.effects.tension import STATE, TensionTable, solved, tension_rise, tension_rise_of_cents
from drumstick.scenes.scene_text import SceneError, parse
from realtime.kernels.jit import njit
from realtime.records import Records


@njit()
def _solved(states: Records, before: float, x: float, y: float) -> float:
    return solved(states[0], before, x, y)


def _energy(stretch: Fraction, kappa: Fraction, most: Fraction) -> Fraction:
    # 2 V.
    size = abs(stretch)
    if kappa * size <= most:
        return kappa * size * size / 2
    return most * (size - most / kappa / 2)


def _by_halves(values: tuple[float, ...]) -> float:
    """q of S+ = S- - x - y q, with q = 2 (V(S+) - V(S-))/(S+ - S-): 120 halves of what it may be."""
    kappa, most, before, x, y = (Fraction(value) for value in values)
    low, high = -most, most
    for _ in range(120):
        q = (low + high) / 2
        after = before - x - y * q
        if after == before:
            pull = max(min(kappa * before, most), -most)
        else:
            pull = (_energy(after, kappa, most) - _energy(before, kappa, most)) / (after - before)
        if pull > q:
            low = q
        else:
            high = q
    return float((low + high) / 2)


def test_the_pull_is_the_one_that_asks_for_itself() -> None:
    chance = random.Random(5)
    states: Any = np.zeros(1, STATE)
    beyond = 0
    for _ in range(500):
        kappa, most = 10.0 ** chance.uniform(-3.0, 3.0), 10.0 ** chance.uniform(-3.0, 0.5)
        corner = most / kappa
        before = corner * chance.choice([0.0, 1.0, -1.0]) * 10.0 ** chance.uniform(-3.0, 4.0)
        x = corner * chance.choice([1.0, -1.0]) * 10.0 ** chance.uniform(-4.0, 4.0)
        y = corner / most * 10.0 ** chance.uniform(-5.0, 4.0)
        states["kappa"], states["q_most"] = kappa, most
        q = _by_halves((kappa, most, before, x, y))
        after = before - x - y * q
        # What is not known of S+ counts as well: y times q may be far less than S- itself.
        slack = 1e-9 * most + 1e-9 * kappa * abs(after - before)
        assert _solved(states, before, x, y) == pytest.approx(q, rel=1e-7, abs=slack)
        beyond += abs(before) > corner or abs(after) > corner
    assert 100 < beyond < 470


@pytest.mark.parametrize("kappa", [0.0, 1.0])
def test_a_head_without_room_is_not_pulled(kappa: float) -> None:
    states: Any = np.zeros(1, STATE)
    states["kappa"] = kappa
    assert _solved(states, 0.3, 0.1, 2.0) == 0.0


def test_what_the_tension_may_rise_by() -> None:
    assert tension_rise_of_cents(1200.0) == pytest.approx(3.0)
    assert tension_rise(TensionTable(glide_cents=80.0)) == pytest.approx(2.5 * (2.0 ** (80.0 / 600.0) - 1.0))
    assert tension_rise(TensionTable(young_GPa=4.0)) == pytest.approx(tension_rise_of_cents(240.0))
    assert tension_rise(TensionTable(young_GPa=4.0, most_cents=100.0)) == pytest.approx(
        tension_rise_of_cents(100.0)
    )


def test_a_rise_that_leaves_no_room_for_its_own_mean_is_refused() -> None:
    text = "[drum.effects.tension]\nglide_cents = 80\nmost_cents = 100\n"
    with pytest.raises(
        SceneError, match=r"leave no room for glide_cents = 80, a mean: give at least 154, or leave it out"
    ):
        parse(text, "a")
    assert parse(text.replace("100", "160"), "a").drum.effects["tension"].most_cents == 160.0
    assert parse(text + "young_GPa = 4\n", "a").drum.effects["tension"].young_GPa == 4.0
