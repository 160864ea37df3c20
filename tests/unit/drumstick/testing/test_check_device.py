"""The conformance suite for devices refuses by its rule each that breaks one; all are one pair of functions.

That an honest one passes is shown by the package in docs/template: tests/contract/test_extend_page.py.
"""

import dataclasses
import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from drumstick.testing import NotConforming, check_device
from haptic_server.servo.device.own_device import Device
from haptic_server.specification import PREMIUM_1_5, Specification
from realtime.records import Record

TOO_FAR, NOT_A_NUMBER, LEFT_OUT, NEVER_NEW, COARSE, ALLOCATES, RAISES, BY_CHANCE = range(8)
RULES = {
    TOO_FAR: "range",
    NOT_A_NUMBER: "finite",
    LEFT_OUT: "finite",
    NEVER_NEW: "fresh",
    COARSE: "resolution",
    ALLOCATES: "allocates nothing",
    RAISES: "raises nothing",
    BY_CHANCE: "deterministic",
}
STEP_M = 3e-5


class Swing(Record):
    """A hand that swings; the rule that it breaks."""

    t_s: float
    breaks: int


def read(state: Any, reading: Any, span_s: float) -> None:
    state.t_s += span_s
    far = 0.2 if state.breaks == TOO_FAR else 0.02
    z_m = far * math.cos(6.0 * state.t_s)
    step_m = 10.0 * STEP_M if state.breaks == COARSE else STEP_M
    if state.breaks == BY_CHANCE:
        z_m += 0.001 * random.random()
    elif state.breaks == ALLOCATES:
        z_m += np.zeros(1 + int(state.t_s))[0]
    elif state.breaks == RAISES and state.t_s > 1.0:
        raise ValueError
    if state.breaks != LEFT_OUT:
        reading.z_m = step_m * math.floor(z_m / step_m)
    if state.breaks == NOT_A_NUMBER and state.t_s > 1.0:
        reading.z_m = math.nan
    reading.fresh = 0 if state.breaks == NEVER_NEW else 1


def write(state: Any, force_N: float) -> None:
    pass


def device(breaks: int) -> Device:
    return Device(PREMIUM_1_5, Swing, read, write, open=lambda: {"breaks": breaks})


@pytest.mark.parametrize("breaks", RULES, ids=list(RULES))
def test_each_broken_rule_is_told_by_name(breaks: int) -> None:
    with pytest.raises(NotConforming, match=r"^liar: ") as told:
        check_device("liar", device(breaks))
    assert told.value.rule == RULES[breaks]


def not_there() -> dict[str, float]:
    raise OSError("no arm at the port")


def other_state() -> dict[str, float]:
    return {"speed": 1.0}


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (not_there, "the device liar: OSError: no arm at the port"),
        (other_state, "the device liar: ValueError: no field of name speed"),
    ],
)
def test_one_that_does_not_open_says_why(given: Callable[[], dict[str, float]], words: str) -> None:
    with pytest.raises(NotConforming, match=f"^liar: declaration: {words}"):
        check_device("liar", Device(PREMIUM_1_5, Swing, read, write, open=given))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"max_force_N": math.inf}, "max_force_N must be above 0 and finite"),
        ({"resolution_m": 0.0}, "resolution_m must be above 0"),
        ({"moving_kg": (0.2, 0.1)}, "two masses above 0, rising"),
        ({"stiffness_N_per_m": math.inf}, "stiffness_N_per_m"),
        ({"damping_N_s_per_m": math.nan}, "damping_N_s_per_m"),
        ({"workspace_m": (0.1, 0.0, 0.1)}, "workspace_m"),
        ({"rates_Hz": range(0)}, "rates_Hz"),
        ({"stiffness_N_per_m": math.nan}, "stiffness_N_per_m must be above 0"),
    ],
)
def test_a_specification_that_no_device_has_is_refused(changes: dict[str, Any], words: str) -> None:
    specification: Specification = dataclasses.replace(PREMIUM_1_5, **changes)
    with pytest.raises(ValueError, match=words):
        Device(specification, Swing, read, write)


def asks_for_more(state: Any, reading: Any, servo: Any) -> None:
    pass


def test_a_function_that_asks_for_what_there_is_not_is_refused() -> None:
    with pytest.raises(ValueError, match="read asks for `servo`; there are: state, reading, span_s"):
        Device(PREMIUM_1_5, Swing, asks_for_more, write)
