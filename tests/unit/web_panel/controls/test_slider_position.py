"""A slider that a browser moves while the main thread moves it back to what holds."""

from types import SimpleNamespace
from typing import Any

import pytest

from web_panel.controls.slider_position import SliderPosition

HELD, MOVED = 0.2, 0.205


@pytest.fixture
def handle() -> Any:
    return SimpleNamespace(value=HELD)


def test_it_stands_where_it_is_told(handle: Any) -> None:
    slider = SliderPosition(handle)
    slider.stand_at(0.3, 1e-9)
    assert handle.value == 0.3
    slider.stand_at(0.3 + 1e-10, 1e-9)
    assert handle.value == 0.3


def test_a_move_that_nothing_is_asked_for_is_taken_back_in_the_turn_after_the_next(handle: Any) -> None:
    slider = SliderPosition(handle)
    handle.value = MOVED
    slider.stand_at(HELD, 1e-9)
    assert handle.value == MOVED
    slider.stand_at(HELD, 1e-9)
    assert handle.value == HELD


@pytest.mark.parametrize("turns_before", [0, 1])
def test_the_turn_that_looked_before_the_request_was_noted_leaves_it(handle: Any, turns_before: int) -> None:
    slider = SliderPosition(handle)
    handle.value = MOVED  # by viser
    for _ in range(turns_before):
        slider.stand_at(HELD, 1e-9)
    # Here the main thread looks: nothing is asked for, it is to stand at HELD.
    slider.note()
    slider.stand_at(HELD, 1e-9)
    assert handle.value == MOVED
