"""The simulated device: the paper's exact stick, or an arm that is sampled as hardware is. Control thread."""

import dataclasses
from pathlib import Path

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.safety.envelope import OutOfEnvelope
from drumstick.scenes.gesture import has_grip, moves_hand
from drumstick.scenes.recording import Recording
from drumstick.stick import moving_hand
from drumstick.stick.hand_path import HOLD
from drumstick.stick.hands import path_of
from drumstick.stick.human.spread import NoSuchSpread
from drumstick.stick.law import law_of
from haptic_server import files
from haptic_server.limits import limits_of
from haptic_server.servo import loop
from haptic_server.servo.device import gesture, paced
from haptic_server.servo.device.protocol import DeviceError, Info
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation.phantom import PLANT
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


def require_uneven(scene: Scene) -> None:
    """Judge a hand that is no machine ([hand.human]) at its strongest. Raises NoSuchSpread or OutOfEnvelope."""
    law = law_of(scene)
    moving_hand.hold_worst(moving_hand.hand_of(scene, moving_hand.STILL)[0], law[0])
    try:
        envelope.require(law, limits_of(scene, EXACT_STICK))
    except OutOfEnvelope as refusal:
        raise OutOfEnvelope(
            f"{scene.name}: hand.human: the roll itself is inside the envelope, its strongest strikes are not (ask "
            f"for a smaller level_dB): {refusal}"
        ) from None


class Simulated:
    """The device `simulated`; `[device] plant` says which. `folder`: where a recorded gesture lies."""

    def __init__(self, scene: Scene, folder: Path | None = None) -> None:
        self._scene = scene
        self._sampled = scene.device.plant == "phantom"
        self._folder = folder
        self._gesture: Recording | None = None

    def open(self) -> None:
        """Read the recorded gesture, if there is one; the device is always there."""
        if self._scene.hand.human is not None:
            try:
                require_uneven(self._scene)
            except NoSuchSpread as error:
                raise DeviceError(f"{self._scene.name}: hand.human: {error}") from None
        if self._scene.hand.gesture != "recorded":
            return
        if self._folder is None:
            raise DeviceError(f"the folder is not known of the gesture {self._scene.hand.gesture_file} lies")
        self.follow(gesture.read(self._folder / files.GESTURE, self._scene))

    def follow(self, recording: Recording) -> None:
        """Let the hand move along this gesture."""
        self._gesture = recording

    def info(self) -> Info:
        """The exact stick, or the arm that it stands for."""
        if not self._sampled:
            follows = f", in a simulated hand: {self._does()}" if self._gesture is not None else ""
            if (human := self._scene.hand.human) is not None:
                follows = f", in an uneven hand: {human.interval_percent:g} %, {human.level_dB:g} dB"
            return Info(EXACT_STICK, (f"simulated stick (no haptic arm){follows}",))
        return Info(
            specification_of(self._scene),
            (f"an arm as a PHANTOM Premium 1.5, in a simulated hand: {self._does()}",),
        )

    def _does(self) -> str:
        hand = self._scene.hand
        if self._gesture is None:
            return hand.gesture
        return f"{hand.gesture}, {hand.gesture_file}, {self._gesture[-1, 0]:g} s, again and again"

    def attach_simulation(self, servo: Servo) -> Servo:
        """The servo with what this device moves in it."""
        if self._sampled:
            return self._with_arm(servo)
        gesture = self._gesture if self._scene.hand.human is None else moving_hand.STILL
        if gesture is None:
            return servo
        hand = moving_hand.hand_of(self._scene, gesture)
        moving_hand.take(hand[0], servo.law.copy()[0])  # as it was set before this servo started
        if moving_hand.makes_worse(hand[0]):  # the speed that a set may keep is judged there too
            worst, tick_state = servo.law.copy(), servo.tick_state
            moving_hand.hold_worst(hand[0], worst[0])
            judgement = envelope.judge(worst[0], servo.envelope_limits[0], servo.scratch)
            tick_state["max_entry_speed"] = min(tick_state["max_entry_speed"][0], judgement.max_entry_speed)
        return servo._replace(moving=hand, moving_path=moving_hand.path_of(self._scene, gesture))

    def _with_arm(self, servo: Servo) -> Servo:
        scene, recorded = self._scene, self._gesture
        plant, head_z_m = arm_of(scene, self.info().specification), scene.device.head_z_m
        held = servo._replace(plant=plant, gesture=path_of(scene, head_z_m + scene.stick.z_ss_m))
        if recorded is None:
            return held
        if has_grip(recorded):
            held = held._replace(
                gripping=moving_hand.hand_of(scene, recorded),
                moving_path=moving_hand.path_of(scene, recorded),
            )
        if not moves_hand(recorded):
            held.gesture["kind"], held.gesture["period_s"] = HOLD, recorded[-1, 0]
            return held
        path = np.ascontiguousarray(recorded[:, (0, 3)])
        path[:, 1] += head_z_m
        plant["z_m"] = plant["hand_m"] = path[0, 1]  # elsewhere the hand would throw it there
        return held._replace(path=path)

    def warm_up(self, spare: Servo) -> None:
        """Compile the loop and touch every path of it."""
        loop.warm_up(spare)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Pace the ticks until asked to stop."""
        return paced.run(self.info().specification, servo, stop)

    def close(self) -> None:
        """Do nothing: no resource is held."""
