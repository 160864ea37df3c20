"""Calibration: the arm must know where it is before it may push. Control thread, before the scheduler runs.

Three styles. AUTO needs nobody. INKWELL wants the stylus put into its holder. ENCODER_RESET takes the pose of this very
moment for the neutral one: done by itself, on an arm that hangs somewhere, it would put the head in the wrong place. So
it is done only when somebody says that they hold the arm in that pose.
"""

from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.openhaptics.driver.hd import Hd
from haptic_server.servo.device.protocol import DeviceError

_STYLES = {
    names.AUTO: "by itself",
    names.INKWELL: "in the inkwell",
    names.ENCODER_RESET: "by resetting the encoders",
}
_TO_DO = {
    names.AUTO: "move the stylus slowly through its whole reach, then start again",
    names.INKWELL: "put the stylus into the inkwell, leave it there, and start again",
    names.ENCODER_RESET: "hold the arm in its neutral pose (both links at right angles, the stylus level: the vendor's "
    "manual shows it), start again with --pose-is-held, and keep holding until it is calibrated",
}


class CalibrationNeeded(DeviceError):
    """Somebody must do something first; the text says what."""


def style_of(hd: Hd) -> int:
    """The style to use, of those that the device has: the one that asks least of people. 0 when it tells none."""
    offered = hd.integer(names.CALIBRATION_STYLE)
    errors = hd.errors()
    if errors:
        raise DeviceError(f"the device does not tell how it is calibrated: {errors[0]}")
    return next((style for style in _STYLES if offered & style), 0)


def _status(hd: Hd) -> int:
    status = hd.check_calibration()
    errors = hd.errors()
    if errors:
        raise DeviceError(f"the device does not tell whether it is calibrated: {errors[0]}")
    return status


def _needed(style: int) -> CalibrationNeeded:
    to_do = _TO_DO.get(style, "calibrate it with the vendor's own program")
    return CalibrationNeeded(f"the device must be calibrated: {to_do}")


def calibrate(hd: Hd, pose_is_held: bool = False) -> str:
    """Bring the device to CALIBRATION_OK; returns words about how. CalibrationNeeded when that takes a person.

    `pose_is_held`: somebody holds the arm in its neutral pose now.
    """
    style = style_of(hd)
    status = _status(hd)
    resets = style == names.ENCODER_RESET
    held = resets and pose_is_held
    if status == names.CALIBRATION_OK and not held:
        return "calibrated before"
    by_hand = resets or status == names.CALIBRATION_NEEDS_MANUAL_INPUT
    if style == 0 or (by_hand and not held):
        raise _needed(style)
    hd.update_calibration(style)
    errors = hd.errors()
    if errors:
        raise DeviceError(f"calibration failed: {errors[0]}")
    if _status(hd) != names.CALIBRATION_OK:
        raise _needed(style)
    return f"calibrated {_STYLES[style]}"
