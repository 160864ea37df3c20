"""Calibration: done where nobody is needed, asked for in words where somebody is."""

import pytest

from haptic_server.servo.device.openhaptics import calibration
from haptic_server.servo.device.openhaptics.calibration import CalibrationNeeded, calibrate
from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.openhaptics.driver.names import AUTO, ENCODER_RESET, INKWELL
from haptic_server.servo.device.protocol import DeviceError
from hd_stand_in import StandIn

pytestmark = pytest.mark.needs("cc")
OK, UPDATE, BY_HAND = (
    names.CALIBRATION_OK,
    names.CALIBRATION_NEEDS_UPDATE,
    names.CALIBRATION_NEEDS_MANUAL_INPUT,
)


@pytest.fixture
def opened(arm: StandIn) -> StandIn:
    arm.hd.init_device(None)
    return arm


@pytest.mark.parametrize(
    ("offered", "chosen"),
    [
        (ENCODER_RESET, ENCODER_RESET),
        (ENCODER_RESET | INKWELL, INKWELL),
        (INKWELL | AUTO, AUTO),
        (ENCODER_RESET | AUTO, AUTO),
        (0, 0),
        (8, 0),
    ],
)
def test_the_style_that_asks_least_of_people_is_chosen(opened: StandIn, offered: int, chosen: int) -> None:
    opened.sim("calibration", offered, OK)
    assert calibration.style_of(opened.hd) == chosen


@pytest.mark.parametrize("style", [AUTO, INKWELL, ENCODER_RESET])
def test_a_calibrated_arm_is_left_alone(opened: StandIn, style: int) -> None:
    opened.sim("calibration", style, OK)
    assert calibrate(opened.hd) == "calibrated before"
    assert opened.sim("style_used") == 0


@pytest.mark.parametrize(("style", "how"), [(AUTO, "by itself"), (INKWELL, "in the inkwell")])
def test_what_needs_nobody_is_done(opened: StandIn, style: int, how: str) -> None:
    opened.sim("calibration", style, UPDATE)
    assert calibrate(opened.hd) == f"calibrated {how}"
    assert opened.sim("style_used") == style


@pytest.mark.parametrize(
    ("style", "status", "words"),
    [
        (AUTO, BY_HAND, "move the stylus"),
        (INKWELL, BY_HAND, "put the stylus into the inkwell"),
        (ENCODER_RESET, BY_HAND, "neutral pose"),
        (ENCODER_RESET, UPDATE, "neutral pose"),
        (0, UPDATE, "the vendor's own program"),
    ],
)
def test_what_needs_a_person_says_what_to_do_and_touches_nothing(
    opened: StandIn, style: int, status: int, words: str
) -> None:
    opened.sim("calibration", style, status)
    with pytest.raises(CalibrationNeeded, match=words):
        calibrate(opened.hd)
    assert opened.sim("style_used") == 0


@pytest.mark.parametrize("status", [OK, UPDATE, BY_HAND])
def test_encoders_are_reset_only_while_somebody_holds_the_pose(opened: StandIn, status: int) -> None:
    opened.sim("calibration", ENCODER_RESET, status)
    assert calibrate(opened.hd, pose_is_held=True) == "calibrated by resetting the encoders"
    assert opened.sim("style_used") == ENCODER_RESET


def test_holding_a_pose_changes_nothing_for_other_styles(opened: StandIn) -> None:
    opened.sim("calibration", INKWELL, BY_HAND)
    with pytest.raises(CalibrationNeeded, match="inkwell"):
        calibrate(opened.hd, pose_is_held=True)


def test_an_answer_that_is_not_known_is_no_calibration(opened: StandIn) -> None:
    opened.sim("calibration", AUTO, 0x5003)
    with pytest.raises(CalibrationNeeded):
        calibrate(opened.hd)


def test_a_device_that_cannot_say_is_an_error(arm: StandIn) -> None:
    with pytest.raises(DeviceError, match="does not tell how it is calibrated"):
        calibrate(arm.hd)
