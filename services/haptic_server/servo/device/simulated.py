"""The simulated device: the paper's exact stick, or an arm that is sampled as hardware is. Control thread."""

import dataclasses
from pathlib import Path

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.stick.hands import path_of
from haptic_server import files
from haptic_server.servo import loop
from haptic_server.servo.device import gesture, paced
from haptic_server.servo.device.protocol import DeviceError, Info
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation.phantom import PLANT
from haptic_server.servo.simulation.recording import Recording
from haptic_server.specification import EXACT_STICK, PREMIUM_1_5, Specification
from realtime.stop import StopRequest

_START_ABOVE_M = 0.02
_TRAVEL_BEYOND_M = 0.05  # the arm's own stops are farther out than what the guard allows
_MASS_RANGE = (0.85, 1.2)  # of the scene's: an arm's apparent mass depends on where in the workspace it is


def specification_of(scene: Scene) -> Specification:
    """A PHANTOM Premium 1.5 whose tip weighs what the scene's stick does, in the scene's hand."""
    low, high = _MASS_RANGE
    stick = scene.stick
    return dataclasses.replace(
        PREMIUM_1_5,
        moving_kg=(low * stick.m_kg, high * stick.m_kg),
        grip_N_per_m=stick.k_hand_N_per_m,
    )


def arm_of(scene: Scene, specification: Specification) -> npt.NDArray[np.void]:
    """The arm that the scene's stick stands for, at rest above the head, shape (1,)."""
    plant = np.zeros(1, PLANT)
    plant["z_m"] = plant["hand_m"] = scene.device.head_z_m + _START_ABOVE_M
    plant["m_kg"] = scene.stick.m_kg
    plant["k_hand_N_per_m"] = scene.stick.k_hand_N_per_m
    plant["r_out_N_s_per_m"] = scene.stick.r_out_N_s_per_m
    plant["friction_N"] = scene.device.friction_N
    plant["resolution_m"] = specification.resolution_m
    plant["max_force_N"] = specification.max_force_N
    plant["lowest_m"] = scene.device.head_z_m + scene.guard.lowest_m - _TRAVEL_BEYOND_M
    plant["highest_m"] = scene.device.head_z_m + scene.guard.highest_m + _TRAVEL_BEYOND_M
    plant["delay_ticks"] = scene.device.delay_ticks
    return plant


class Simulated:
    """The device `simulated`; `[device] plant` says which. `folder`: where a recorded gesture lies."""

    def __init__(self, scene: Scene, folder: Path | None = None) -> None:
        self._scene = scene
        self._sampled = scene.device.plant == "phantom"
        self._folder = folder
        self._path: npt.NDArray[np.float64] | None = None

    def open(self) -> None:
        """Read the recorded gesture, if there is one; the device is always there."""
        if self._scene.hand.gesture != "recorded":
            return
        if self._folder is None:
            raise DeviceError(f"the folder is not known of the gesture {self._scene.hand.gesture_file} lies")
        self.follow(gesture.read(self._folder / files.GESTURE, self._scene))

    def follow(self, recording: Recording) -> None:
        """Let the hand move along this gesture."""
        self._path = np.ascontiguousarray(recording[:, (0, 3)])
        self._path[:, 1] += self._scene.device.head_z_m

    def info(self) -> Info:
        """The exact stick, or the arm that it stands for."""
        if not self._sampled:
            return Info(EXACT_STICK, ("simulated stick (no haptic arm)",))
        does = self._scene.hand.gesture
        if self._path is not None:
            does = f"{does}, {self._scene.hand.gesture_file}, {self._path[-1, 0]:g} s, again and again"
        return Info(
            specification_of(self._scene), (f"an arm as a PHANTOM Premium 1.5, in a simulated hand: {does}",)
        )

    def attach_simulation(self, servo: Servo) -> Servo:
        """The servo with what this device moves in it."""
        if not self._sampled:
            return servo
        plant = arm_of(self._scene, self.info().specification)
        path = servo.path if self._path is None else self._path
        if self._path is not None:
            plant["z_m"] = plant["hand_m"] = self._path[0, 1]  # elsewhere the hand would throw it there
        return servo._replace(
            plant=plant,
            gesture=path_of(self._scene, self._scene.device.head_z_m + self._scene.stick.z_ss_m),
            path=path,
        )

    def warm_up(self, spare: Servo) -> None:
        """Compile the loop and touch every path of it."""
        loop.warm_up(spare)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Pace the ticks until asked to stop."""
        return paced.run(self.info().specification, servo, stop)

    def close(self) -> None:
        """Do nothing: no resource is held."""
