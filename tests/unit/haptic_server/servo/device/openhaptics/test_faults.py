"""From HD errors to faults: every known error means something, and the worst one is told."""

import pytest

from haptic_server.records import FAULT_WORDS, FORCE_ERROR, NO_FAULT, SCHEDULER, UNPLUGGED, WARM
from haptic_server.servo.device.openhaptics.driver import faults, names
from haptic_server.servo.device.openhaptics.driver.faults import fault_of, is_hard, words_of, worse

ERRORS = {
    name: value
    for name, value in vars(names).items()
    if isinstance(value, int) and 0x0100 <= value <= 0x0600 and name.isupper()
}


def test_there_are_twenty_one_errors_each_with_words() -> None:
    assert len(ERRORS) == 21
    for code in ERRORS.values():
        assert "not documented" not in words_of(code)
        assert fault_of(code) in FAULT_WORDS
        assert fault_of(code) != NO_FAULT


@pytest.mark.parametrize(
    ("code", "fault", "hard"),
    [
        (names.SUCCESS, NO_FAULT, False),
        (names.WARM_MOTORS, WARM, False),
        (names.EXCEEDED_MAX_FORCE, FORCE_ERROR, False),
        (names.EXCEEDED_MAX_FORCE_IMPULSE, FORCE_ERROR, False),
        (names.EXCEEDED_MAX_VELOCITY, FORCE_ERROR, False),
        (names.FORCE_ERROR, FORCE_ERROR, False),
        (names.DEVICE_FAULT, UNPLUGGED, True),
        (names.COMM_ERROR, UNPLUGGED, True),
        (names.COMM_CONFIG_ERROR, UNPLUGGED, True),
        (names.TIMER_ERROR, SCHEDULER, True),
        (names.FRAME_ERROR, SCHEDULER, True),
        (names.SCHEDULER_FULL, SCHEDULER, True),
        (0x0777, SCHEDULER, True),
    ],
)
def test_each_error_means_its_fault(code: int, fault: int, hard: bool) -> None:
    assert fault_of(code) == fault
    assert is_hard(fault) == hard


def test_a_hard_fault_is_told_before_any_other_and_the_first_of_equals_stays() -> None:
    assert worse(NO_FAULT, WARM) == WARM
    assert worse(WARM, FORCE_ERROR) == WARM
    assert worse(WARM, UNPLUGGED) == UNPLUGGED
    assert worse(UNPLUGGED, SCHEDULER) == UNPLUGGED
    assert worse(UNPLUGGED, WARM) == UNPLUGGED
    assert worse(FORCE_ERROR, NO_FAULT) == FORCE_ERROR


def test_an_error_that_nobody_knows_keeps_its_number() -> None:
    assert faults.words_of(0x0777, -3) == "an error that is not documented (HD error 0x0777, internal -3)"
