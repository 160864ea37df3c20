"""Every device that ships, ready for the conformance suite: one more device is one more `Case` here."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.records import POINTER
from haptic_server.servo.device import own_device
from haptic_server.servo.device.openhaptics.device import OpenHaptics
from haptic_server.servo.device.pointer import Pointed
from haptic_server.servo.device.protocol import Device
from haptic_server.servo.device.replay import ReplayDevice
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.force.rendering import render
from haptic_server.specification import PREMIUM_1_5
from hd_stand_in import CENTRE_MM, StandIn
from realtime import triple_buffer
from realtime.records import Record


def _nothing(servo: Servo) -> None:
    pass


@dataclass
class Case:
    """A device of which nothing is open yet, and a scene that it can play.

    press: put the stick into the head, where the device does not do so by itself, for less than a second.
    motors: every force along z that the device's motors were really given, where something outside the device knows it.
    judge: what an outsider has to say in the end.
    """

    device: Device
    scene: Scene
    wrong_rate_hz: int
    is_sampled: bool = True
    press: Callable[[Servo], None] = _nothing
    motors: Callable[[], npt.NDArray[np.float64]] | None = None
    judge: Callable[[], None] = field(default=lambda: None)

    def servo(self, rate_Hz: int | None = None) -> Servo:
        """Its servo in a block of its own, furnished; the device must be open. `rate_Hz`: another than the scene's."""
        made = memory.prepare(
            self.scene, blocks.in_memory(law_of(self.scene)), specification=self.device.info().specification
        )
        if rate_Hz is not None:
            made.plan["period_ns"] = round(1e9 / rate_Hz)
        return self.device.attach_simulation(made)


def stick(folder: Path) -> Case:
    """The exact stick: it rolls by itself."""
    scene = parse(shipped_text("roll"), "roll")
    return Case(Simulated(scene), scene, wrong_rate_hz=100, is_sampled=False)


def phantom(folder: Path) -> Case:
    """The simulated arm, in a hand that presses again and again."""
    scene = sampled_arm.scene("press")
    return Case(Simulated(scene), scene, wrong_rate_hz=8000)


def replay(folder: Path) -> Case:
    """A recording that goes into the head every half second."""
    path = folder / "recording.csv"
    path.write_text("t_s,z_m\n0,0.02\n0.1,0.02\n0.2,-0.002\n0.4,-0.002\n0.5,0.02\n", encoding="utf-8")
    return Case(ReplayDevice(path), sampled_arm.scene(), wrong_rate_hz=100)


class _Swing(Record):
    """Another package's arm, which a hand swings through the head."""

    t_s: float


def _read_swing(state: Any, reading: Any, span_s: float) -> None:
    state.t_s += span_s
    reading.z_m = 3e-5 * math.floor((0.004 + 0.006 * math.cos(12.0 * state.t_s)) / 3e-5)
    reading.fresh = 1


def _write_nothing(state: Any, force_N: float) -> None:
    pass


def own(folder: Path) -> Case:
    """A device that another package gives."""
    given = own_device.Device(PREMIUM_1_5, _Swing, _read_swing, _write_nothing)
    return Case(own_device.OwnDevice(given, "swing", __name__), sampled_arm.scene(), wrong_rate_hz=100)


def _point_down(servo: Servo) -> None:
    # Heard once, which counts for 0.4 s: long enough to reach the head.
    record = np.zeros(1, POINTER)
    record["t_ns"] = time.monotonic_ns()
    record["held"], record["lift"] = 1, 0.0
    triple_buffer.publish(servo.block.pointer_cells, servo.block.pointer, record[0])


def pointer_stick(folder: Path) -> Case:
    """The exact stick in a hand that somebody points at."""
    scene = parse(shipped_text("roll"), "roll")
    return Case(Pointed(scene), scene, wrong_rate_hz=100, is_sampled=False, press=_point_down)


def pointer_arm(folder: Path) -> Case:
    """The simulated arm in such a hand."""
    return Case(Pointed(sampled_arm.scene()), sampled_arm.scene(), wrong_rate_hz=8000, press=_point_down)


def openhaptics(folder: Path, built: Path) -> Case:
    """The driver of a real arm, over the stand-in library."""
    arm = StandIn(built, folder)
    arm.sim("place", 0.0, CENTRE_MM[1] + 10.0, 0.0)
    return Case(
        OpenHaptics(render, load=arm.load),
        sampled_arm.scene(),
        wrong_rate_hz=1143,
        press=lambda _: arm.sim("swing", CENTRE_MM[1], 15.0, 0.4),
        motors=lambda: arm.sent()[0],
        judge=arm.clean,
    )
