"""From the errors of the HD layer to the faults of the servo.

A hard fault is one after which the driver cannot be trusted to move the arm on: the callback ends, and the device is
opened again only by a new process. The others hold the servo until somebody arms it.
"""

from haptic_server.records import FORCE_ERROR, NO_FAULT, SCHEDULER, UNPLUGGED, WARM
from haptic_server.servo.device.openhaptics.driver import names
from realtime.kernels.jit import njit

_WORDS = {
    names.INVALID_ENUM: "a name that this driver does not know",
    names.INVALID_VALUE: "a value that this driver does not take",
    names.INVALID_OPERATION: "a call at the wrong time",
    names.INVALID_INPUT_TYPE: "a value of the wrong type",
    names.BAD_HANDLE: "no such device",
    names.WARM_MOTORS: "the motors are too warm",
    names.EXCEEDED_MAX_FORCE: "more force than the device has",
    names.EXCEEDED_MAX_FORCE_IMPULSE: "the force changed faster than the driver allows",
    names.EXCEEDED_MAX_VELOCITY: "the arm moved faster than the driver allows",
    names.FORCE_ERROR: "the force could not be made",
    names.DEVICE_FAULT: "the device reports a fault of its own",
    names.DEVICE_ALREADY_INITIATED: "another program, or this one, has the device open",
    names.COMM_ERROR: "the device does not answer",
    names.COMM_CONFIG_ERROR: "the connection to the device is not set up",
    names.TIMER_ERROR: "the driver's servo timer failed",
    names.ILLEGAL_BEGIN: "a frame was begun twice",
    names.ILLEGAL_END: "a frame was ended that was not begun",
    names.FRAME_ERROR: "more than one frame in a tick",
    names.INVALID_PRIORITY: "a priority out of range",
    names.SCHEDULER_FULL: "the driver's scheduler is full",
    names.INVALID_LICENSE: "OpenHaptics has no valid licence on this machine",
}


def words_of(code: int, internal: int = 0) -> str:
    """An HD error in words, with its numbers."""
    known = _WORDS.get(code, "an error that is not documented")
    return f"{known} (HD error 0x{code:04x}, internal {internal})"


@njit()
def fault_of(code: int) -> int:
    """The fault that an HD error means in the tick; NO_FAULT for success. Tick thread."""
    if code == names.SUCCESS:
        return NO_FAULT
    if code == names.WARM_MOTORS:
        return WARM
    if 0x0200 <= code < 0x0300:
        return FORCE_ERROR
    if 0x0300 <= code < 0x0400 and code != names.TIMER_ERROR:
        return UNPLUGGED
    return SCHEDULER  # timer, scheduler, frames, and whatever our calls should never have caused


@njit()
def is_hard(fault: int) -> bool:
    """True when only a new process can get over it. Tick thread."""
    return fault in (UNPLUGGED, SCHEDULER)


@njit()
def worse(first: int, second: int) -> int:
    """Choose the fault to report of two: a hard one first, else the earlier. Tick thread."""
    if first == NO_FAULT or (is_hard(second) and not is_hard(first)):
        return second
    return first
