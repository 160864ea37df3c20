"""The servo callback on the stand-in: force and frame, and no force on the very tick that something is wrong."""

from collections.abc import Callable

import numpy as np
import pytest

from haptic_server.block_header import ARM
from haptic_server.records import (
    FAULT,
    FORCE_ERROR,
    NO_FAULT,
    NOT_A_NUMBER,
    SAFETY_SWITCH,
    STALLED,
    STATUS,
    UNPLUGGED,
    WARM,
)
from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.rendering import render
from hd_laws import STEADY_N, WALL_N_PER_M, deaf, greedy, senseless, servo_at, stubborn, wall
from hd_stand_in import AT_BEGIN, AT_END, CENTRE_MM, StandIn, playing
from realtime import triple_buffer
from realtime.atomics import poke

pytestmark = [pytest.mark.needs("cc"), pytest.mark.timeout(600)]


def status_of(servo: Servo) -> np.void:
    out = np.zeros(1, STATUS)
    triple_buffer.read_into(servo.block.status_cells, servo.block.status, out)
    return out[0]


def zero_from_the_bad_tick_on(arm: StandIn) -> bool:
    """Force before, none with the tick that saw it and after; the stand-in noted which that was."""
    forces, _ = arm.sent()
    bad = arm.sim("bad_at")
    return bool(bad > 0 and (forces[:bad] == STEADY_N).all() and (forces[bad:] == 0.0).all())


def test_the_force_is_the_laws_answer_to_the_position_of_the_same_tick(arm: StandIn) -> None:
    arm.sim("place", 10.0, 40.0, -20.0)
    servo = servo_at()
    with playing(arm, wall, servo):
        arm.wait_ticks(300)
        arm.sim("buttons", 5)
        arm.wait_ticks(50)
        reading = servo.reading.copy()[0]
    forces, heights = arm.sent()
    expected = np.maximum(-WALL_N_PER_M * (heights - CENTRE_MM[1]) * 1e-3, 0.0)
    np.testing.assert_allclose(forces[:-1], expected[:-1], rtol=1e-12, atol=1e-12)
    assert (reading["x_m"], reading["y_m"], reading["buttons"]) == pytest.approx((0.01, 0.02, 5))
    assert np.ptp(heights) > 5.0, "the force moves the arm"
    assert heights[-100:].mean() > heights[0]
    arm.clean()


def test_the_last_frame_before_the_end_has_no_force(arm: StandIn) -> None:
    with playing(arm, stubborn, servo_at()) as run:
        arm.wait_ticks(20)
    assert run.fault == NO_FAULT
    forces, _ = arm.sent()
    assert forces[-1] == 0.0
    assert (forces[:-1] == STEADY_N).all()
    arm.clean()


def _unplug(arm: StandIn) -> None:
    arm.sim("unplug", 1)


def _fault_at_begin(arm: StandIn) -> None:
    arm.sim("raise", names.DEVICE_FAULT, AT_BEGIN)


def _fault_at_end(arm: StandIn) -> None:
    arm.sim("raise", names.COMM_ERROR, AT_END)


@pytest.mark.parametrize("break_it", [_unplug, _fault_at_begin, _fault_at_end])
def test_a_device_that_is_gone_gets_no_force_and_no_further_call(
    arm: StandIn, break_it: Callable[[StandIn], None]
) -> None:
    servo = servo_at()
    with playing(arm, stubborn, servo) as run:
        arm.wait_ticks(20)
        break_it(arm)
        assert run.join() == UNPLUGGED
    forces, _ = arm.sent()
    assert zero_from_the_bad_tick_on(arm)
    assert forces.size == arm.sim("bad_at") + 1, "the callback ends with the tick that told the law"
    status = status_of(servo)
    assert (status["status"], status["fault"], status["force_N"]) == (FAULT, UNPLUGGED, 0.0)
    arm.clean()


def _nan(arm: StandIn, on: int) -> None:
    arm.sim("nan", on)


def _mute(arm: StandIn, on: int) -> None:
    arm.sim("mute", on)


def _warm(arm: StandIn, on: int) -> None:
    arm.sim("warm", float(on))


def _switch(arm: StandIn, on: int) -> None:
    arm.sim("switch", 1, 1 - on)


def _velocity(arm: StandIn, on: int) -> None:
    if on:
        arm.sim("raise", names.EXCEEDED_MAX_VELOCITY, AT_BEGIN)


def _impulse(arm: StandIn, on: int) -> None:
    if on:
        arm.sim("raise", names.EXCEEDED_MAX_FORCE_IMPULSE, AT_END)


@pytest.mark.parametrize(
    ("disturb", "fault"),
    [
        (_nan, NOT_A_NUMBER),
        (_mute, NOT_A_NUMBER),
        (_warm, WARM),
        (_switch, SAFETY_SWITCH),
        (_velocity, FORCE_ERROR),
        (_impulse, FORCE_ERROR),
    ],
)
def test_what_passes_leaves_no_force_until_somebody_arms(
    arm: StandIn, disturb: Callable[[StandIn, int], None], fault: int
) -> None:
    """The law here goes on asking for force; that it holds its fault is enough for the driver to send none."""
    servo = servo_at()
    arm.sim("switch", 1, 1)
    with playing(arm, stubborn, servo):
        arm.wait_ticks(20)
        disturb(arm, 1)
        arm.wait_ticks(20)
        disturb(arm, 0)
        arm.wait_ticks(50)
        assert zero_from_the_bad_tick_on(arm)
        assert status_of(servo)["fault"] == fault
        poke(servo.block.control, ARM, 1)
        arm.wait_ticks(20)
        forces, _ = arm.sent()
        assert (forces[-5:] == STEADY_N).all()
        assert np.isfinite([servo.reading[0][axis] for axis in ("x_m", "y_m", "z_m")]).all()
    arm.clean()


@pytest.mark.parametrize("disturb", [_nan, _mute, _warm, _switch])
def test_while_something_is_wrong_even_a_deaf_law_moves_nothing(
    arm: StandIn, disturb: Callable[[StandIn, int], None]
) -> None:
    arm.sim("switch", 1, 1)
    arm.sim("buttons", 1)
    servo = servo_at()
    with playing(arm, deaf, servo):
        arm.wait_ticks(20)
        disturb(arm, 1)
        arm.wait_ticks(20)
        assert zero_from_the_bad_tick_on(arm)
        assert servo.reading[0]["buttons"] == (0 if disturb is _mute else 1)
    arm.clean()


def test_a_switch_that_was_never_closed_is_taken_for_none(arm: StandIn) -> None:
    arm.sim("switch", 1, 0)
    servo = servo_at()
    with playing(arm, stubborn, servo):
        arm.wait_ticks(30)
    forces, _ = arm.sent()
    assert (forces[:-1] == STEADY_N).all()
    arm.clean()


def test_a_stall_is_seen_as_a_span_and_holds(arm: StandIn) -> None:
    servo = servo_at()
    with playing(arm, render, servo):
        arm.wait_ticks(150)
        arm.sim("stall", 0.06)
        arm.wait_ticks(20)
        status = status_of(servo)
    assert status["fault"] == STALLED
    assert status["lateness_worst_ns"] > 50e6
    assert status["overruns"] > 50
    arm.clean()


def test_the_temperature_is_the_warmest_motors_and_read_now_and_then(arm: StandIn) -> None:
    arm.sim("warm", 0.6)
    servo = servo_at()
    with playing(arm, wall, servo):
        arm.wait(lambda: servo.reading[0]["temperature"] == 0.6)
        arm.sim("warm", 0.8)
        arm.wait(lambda: servo.reading[0]["temperature"] == 0.8)
    arm.clean()


def test_a_flood_of_errors_does_not_stop_the_tick(arm: StandIn) -> None:
    servo = servo_at()
    with playing(arm, wall, servo):
        arm.sim("flood", 50)
        arm.wait_ticks(200)
        assert status_of(servo)["fault"] == FORCE_ERROR
        arm.sim("flood", 0)
        arm.wait_ticks(20)
    arm.clean()


def test_no_more_force_than_the_device_has(arm: StandIn) -> None:
    arm.sim("place", 0.0, CENTRE_MM[1] - 1.0, 0.0)
    with playing(arm, greedy, servo_at()):
        arm.wait(lambda: arm.sim("height") > CENTRE_MM[1])
        arm.wait_ticks(20)
    forces, _ = arm.sent()
    assert set(forces[:-1].tolist()) == {-8.5, 8.5}
    arm.clean()


def test_a_law_that_answers_nonsense_moves_nothing(arm: StandIn) -> None:
    arm.sim("place", 0.0, 60.0, 0.0)
    with playing(arm, senseless, servo_at()):
        arm.wait_ticks(20)
        arm.sim("place", 0.0, 40.0, 0.0)
        arm.wait_ticks(20)
    forces, heights = arm.sent()
    assert (forces == 0.0).all()
    assert heights.min() < CENTRE_MM[1] < heights.max()
    arm.clean()
