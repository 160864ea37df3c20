"""The device as a whole: opened, run and closed in the maker's order, and what it says when it cannot."""

import time
from collections.abc import Callable

import numpy as np
import pytest

from haptic_server.block import RING_SLOTS
from haptic_server.block_header import STOP
from haptic_server.records import EVENT, FAULT, NO_FAULT, RELEASE, SCHEDULER, STATUS, STRIKE, UNPLUGGED
from haptic_server.servo.device.openhaptics import callback, port
from haptic_server.servo.device.openhaptics.calibration import CalibrationNeeded
from haptic_server.servo.device.openhaptics.device import OpenHaptics
from haptic_server.servo.device.openhaptics.driver import names
from haptic_server.servo.device.protocol import Device, DeviceError
from haptic_server.servo.force.rendering import render
from hd_laws import servo_at, wall
from hd_stand_in import CENTRE_MM, Playing, StandIn, playing, undisturbed
from realtime import ring, triple_buffer
from realtime.atomics import poke
from realtime.kernels.handover import ForeignHandle
from realtime.stop import StopRequest

PATIENCE_S = 120.0  # the forces that the stand-in keeps are of 131 s
pytestmark = [pytest.mark.needs("cc"), pytest.mark.timeout(600)]


def diary(arm: StandIn) -> list[str]:
    return [word for word in arm.sim("diary").split() if not word.startswith(("enable(400", "off(400"))]


def test_it_is_a_device() -> None:
    device: Device = OpenHaptics(wall)
    with pytest.raises(DeviceError, match="not open"):
        device.info()
    device.close()


def test_everything_happens_in_the_makers_order(arm: StandIn) -> None:
    with playing(arm, wall, servo_at()):
        arm.wait_ticks(10)
    assert diary(arm) == [
        "init(NULL)",
        "rate(1000)",
        "schedule(65535)",
        "start",
        "done",
        "stop",
        "unschedule",
        "disable",
    ]
    words = arm.sim("diary").split()
    assert words.index("schedule(65535)") < words.index("enable(4000)") < words.index("start")
    assert words.index("unschedule") < words.index("off(4000)") < words.index("disable")
    arm.clean()


def test_without_run_there_is_never_a_force(arm: StandIn) -> None:
    device = OpenHaptics(wall, load=arm.load)
    device.open()
    with pytest.raises(DeviceError, match="open already"):
        device.open()
    device.close()
    device.close()
    assert "enable(4000)" not in arm.sim("diary")
    assert diary(arm) == ["init(NULL)", "disable"]
    arm.clean()


def test_it_tells_how_it_was_opened_and_what_it_found(arm: StandIn) -> None:
    arm.sim("configure", b"Default PHANToM")
    arm.sim("calibration", names.INKWELL, names.CALIBRATION_NEEDS_UPDATE)
    arm.sim("stuck", names.FORCE_RAMPING)
    with playing(arm, wall, servo_at()):
        arm.wait_ticks(100)
    device = OpenHaptics(wall, load=arm.load)
    device.open()
    text = "\n".join(device.info().words)
    for part in (
        'stand-in, opened as "Default PHANToM"',
        "calibrated before",
        "force ramping could not be switched on",
        "400 N/s in force",
        "does not tell of a safety switch",
    ):
        assert part in text
    device.close()


def test_a_stop_from_the_block_is_as_good_as_one_by_request(arm: StandIn) -> None:
    servo = servo_at()
    with playing(arm, wall, servo) as run:
        arm.wait_ticks(10)
        poke(servo.block.control, STOP, 1)
        assert run.join() == NO_FAULT
    arm.clean()


def test_a_stop_that_came_first_is_heard(arm: StandIn) -> None:
    device, servo, stop = OpenHaptics(wall, load=arm.load), servo_at(), StopRequest()
    device.open()
    stop.ask()
    assert device.run(servo, stop) == NO_FAULT
    device.close()
    forces, _ = arm.sent()
    assert forces.size >= 1
    arm.clean()


def test_a_driver_that_falls_silent_is_noticed_and_told(arm: StandIn) -> None:
    servo = servo_at()
    with playing(arm, wall, servo) as run:
        arm.wait_ticks(20)
        arm.sim("silence", 1)
        assert run.join() == SCHEDULER
    status = np.zeros(1, STATUS)
    triple_buffer.read_into(servo.block.status_cells, servo.block.status, status)
    assert (status["status"][0], status["fault"][0], status["force_N"][0]) == (FAULT, SCHEDULER, 0.0)
    assert diary(arm)[-3:] == ["stop", "unschedule", "disable"]
    arm.clean()


def test_a_rehearsal_compiles_for_the_run_and_touches_no_device(arm: StandIn) -> None:
    device = OpenHaptics(wall, load=arm.load)
    spare, servo = servo_at(), servo_at()
    device.warm_up(spare)
    assert arm.sim("diary") == ""
    assert spare.tick_state[0]["fault"] == SCHEDULER
    kind, blank = ForeignHandle((servo, port.blank(1_000_000))).kind, port.blank(1_000_000)
    before = callback._compiled.cache_info().misses  # pyright: ignore[reportPrivateUsage]
    callback.Callback(wall, servo, blank)
    assert callback._compiled.cache_info().misses == before  # pyright: ignore[reportPrivateUsage]
    assert kind == ForeignHandle((spare, blank)).kind


@pytest.mark.parametrize("rate_hz", [500, 1143, 2000])
def test_it_runs_at_the_rate_that_it_was_asked_for(arm: StandIn, rate_hz: int) -> None:
    arm.sim("bus", 1)
    servo = servo_at(rate_hz)
    with playing(arm, wall, servo):
        arm.wait_ticks(50)
    assert f"rate({rate_hz})" in diary(arm)
    assert servo.status[0]["tick"] == arm.sim("called")
    arm.clean()


def test_a_rate_that_the_driver_refuses_is_an_error_before_any_force(arm: StandIn) -> None:
    device = OpenHaptics(wall, load=arm.load)
    device.open()
    with pytest.raises(DeviceError, match="refuses a servo rate of 1143 Hz"):
        device.run(servo_at(1143), StopRequest())
    device.close()
    assert diary(arm) == ["init(NULL)", "rate(1143)", "disable"]
    assert "enable(4000)" not in arm.sim("diary")
    arm.clean()


def test_force_output_that_does_not_come_on_takes_everything_back(arm: StandIn) -> None:
    arm.sim("stuck", names.FORCE_OUTPUT)
    device = OpenHaptics(wall, load=arm.load)
    device.open()
    with pytest.raises(DeviceError, match="force output could not be switched on"):
        device.run(servo_at(), StopRequest())
    device.close()
    assert diary(arm)[-2:] == ["unschedule", "disable"]
    arm.clean()


def test_a_device_that_must_be_calibrated_is_let_go_again(arm: StandIn) -> None:
    arm.sim("calibration", names.ENCODER_RESET, names.CALIBRATION_NEEDS_MANUAL_INPUT)
    with pytest.raises(CalibrationNeeded, match="neutral pose"):
        OpenHaptics(wall, load=arm.load).open()
    assert diary(arm) == ["init(NULL)", "disable"]
    held = OpenHaptics(wall, load=arm.load, pose_is_held=True)
    held.open()
    assert "calibrated by resetting the encoders" in held.info().words
    held.close()
    arm.clean()


def test_a_roll_is_played_with_the_real_law(new_arm: Callable[[], StandIn]) -> None:
    """The hand lifts, presses down, lifts: the law that a PHANTOM gets strikes the head and lets go of it."""
    events = np.zeros(RING_SLOTS, EVENT)
    counts: list[int] = []

    def play(arm: StandIn) -> None:
        arm.sim("place", 0.0, CENTRE_MM[1] + 10.0, 0.0)
        servo = servo_at()
        with playing(arm, render, servo):
            arm.wait_ticks(500)
            end = time.monotonic() + PATIENCE_S
            # A stroke in which the machine stood still for over 5 ms is not played, and is no fault; after a longer
            # stop the whole of this is played again.
            while servo.tick_state[0]["seq"] < 3 and arm.sim("worst_gap") < 0.015 and time.monotonic() < end:
                arm.sim("hand", CENTRE_MM[1] - 15.0)
                arm.wait_ticks(250)
                arm.sim("hand", CENTRE_MM[1] + 15.0)
                arm.wait_ticks(250)
        counts.append(ring.drain(servo.block.ring_cells, servo.block.events, events))

    arm = undisturbed(new_arm, play)
    kinds = events["kind"][: counts[-1]]
    assert (kinds == STRIKE).sum() >= 3
    assert (kinds == STRIKE).sum() == (kinds == RELEASE).sum()
    forces, heights = arm.sent()
    assert forces.max() > 0.5
    # Only what is left of a pulse (tau 4 ms) reaches above the head, and nothing of it as high as this.
    assert np.abs(forces[heights > CENTRE_MM[1] + 10.0]).max() < 0.01
    arm.clean()


def test_the_real_law_pushes_no_more_once_the_device_is_gone(new_arm: Callable[[], StandIn]) -> None:
    said: list[str] = []

    def play(arm: StandIn) -> None:
        arm.sim("place", 0.0, CENTRE_MM[1] + 10.0, 0.0)
        device, servo = OpenHaptics(render, load=arm.load), servo_at()
        device.open()
        run = Playing(device, servo)
        arm.wait(lambda: arm.sim("called") > 400)
        # Again and again: a stroke in which the machine stood still for over 5 ms is not played.
        arm.sim("swing", CENTRE_MM[1], 15.0, 0.4)
        arm.wait(lambda: arm.sim("force") > 0.3 or arm.sim("worst_gap") > 0.015)
        arm.sim("unplug", 1)
        assert run.join() == UNPLUGGED
        said[:] = device.info().words
        device.close()

    arm = undisturbed(new_arm, play)
    forces, _ = arm.sent()
    bad = arm.sim("bad_at")
    assert forces[:bad].max() > 0.3
    assert (forces[bad:] == 0.0).all()
    assert any(words.startswith("ended by the device does not answer") for words in said)
    assert any(words.startswith("force output could not be switched off") for words in said)
    arm.clean()
