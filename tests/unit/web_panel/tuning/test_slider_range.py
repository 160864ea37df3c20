import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.parameters.declare import Quantity
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from web_panel.tuning.slider_range import range_around

TABLE = table_of(parse(shipped_text("roll"), "roll.toml"))
NAMES = sorted(TABLE)


def test_the_stiffness_travels_a_decade_each_way_by_its_logarithm() -> None:
    travel = range_around(TABLE["k_coll"].quantity, 5000.0)
    assert (travel.low, travel.high, travel.log) == (500.0, 50000.0, True)
    assert travel.position(5000.0) == pytest.approx(0.5 * (travel.low_position + travel.high_position))
    assert travel.value(travel.position(5000.0)) == 5000.0
    assert [label for _, label in travel.marks()] == ["500", "1k", "2k", "5k", "10k", "20k", "50k"]


def test_the_pulse_travels_from_zero_in_round_steps() -> None:
    travel = range_around(TABLE["dv_pls"].quantity, 0.2)
    assert (travel.low, travel.high, travel.step, travel.log) == (0.0, 1.0, 0.005, False)


def test_a_place_travels_to_both_sides_of_the_head() -> None:
    travel = range_around(TABLE["z_ss"].quantity, -0.02)
    assert (travel.low, travel.high) == (-0.1, 0.1)


@given(st.sampled_from(NAMES), st.floats(0.0, 1.0))
def test_every_position_is_a_value_that_the_table_allows(name: str, share: float) -> None:
    parameter = TABLE[name]
    travel = range_around(parameter.quantity, parameter.from_norm(share))
    for i in range(9):
        position = travel.low_position + (travel.high_position - travel.low_position) * i / 8
        parameter.check(travel.value(position))


@given(st.sampled_from(NAMES), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_it_stretches_to_whatever_the_servo_uses(name: str, first: float, other: float) -> None:
    parameter = TABLE[name]
    travel = range_around(parameter.quantity, parameter.from_norm(first))
    value = parameter.from_norm(other)
    wider = travel.including(value, parameter.quantity)
    least = min(travel.low, value)
    assert wider.low <= least + abs(least) * 1e-12 + 1e-12
    most = max(travel.high, value)
    assert wider.high >= most - abs(most) * 1e-12 - 1e-12
    assert wider.low_position <= wider.position(value) <= wider.high_position
    assert 0.0 < wider.step <= wider.high_position - wider.low_position


def test_what_is_closed_is_a_share_of_the_travel_from_either_end() -> None:
    travel = range_around(TABLE["k_coll"].quantity, 5000.0)
    assert travel.closed(1000.0, 5000.0) == pytest.approx((math.log10(2.0) / 2.0, 0.5))
    assert travel.closed(1.0, 1e6) == (0.0, 0.0)


@given(st.sampled_from(NAMES), st.floats(0.0, 1.0))
def test_marks_are_few_and_lie_on_the_slider(name: str, share: float) -> None:
    parameter = TABLE[name]
    travel = range_around(parameter.quantity, parameter.from_norm(share))
    marks = travel.marks()
    assert 1 <= len(marks) <= 8
    assert all(travel.low_position - 1e-3 <= at <= travel.high_position + 1e-3 for at, _ in marks)


def test_a_value_that_is_none_at_all_still_gives_a_slider() -> None:
    travel = range_around(TABLE["z_h0"].quantity, math.nan)
    assert travel.low < 0.0 < travel.high
    assert travel.including(math.nan, TABLE["z_h0"].quantity) == travel


def test_zero_travels_a_twentieth_of_the_range() -> None:
    travel = range_around(Quantity(float, 0.0, 10.0, "m/s"), 0.0)
    assert (travel.low, travel.high) == (0.0, 0.5)
    assert range_around(Quantity(float, 0.0, 10.0, "m/s"), 5e-324) == travel


@pytest.mark.parametrize("value", [0.0, 0.1, 1.0])
def test_a_share_has_its_whole_travel_wherever_it_stands(value: float) -> None:
    muffle = table_of(parse("[drum.effects.muffle]\n", "muffled"))["muffle"].quantity
    travel = range_around(muffle, value)
    assert (travel.low, travel.high, travel.log) == (0.0, 1.0, False)
