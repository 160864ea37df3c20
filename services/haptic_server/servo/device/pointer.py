"""The device `pointer`: the simulated stick in a hand that goes where a mouse or a finger points. Control thread.

For people without an arm. What points is the technician's page or any program on the wire; it reaches the servo through
the gateway and the block. It can move this hand and nothing else: a panic or a fault that holds the servo stays.
"""

import numpy as np

from drumstick.parameters.scene import Scene
from haptic_server.servo import loop
from haptic_server.servo.device import paced, simulated
from haptic_server.servo.device.protocol import Info
from haptic_server.servo.force.memory import Servo
from haptic_server.servo.simulation.pointed_hand import HAND, LIFTED_M
from haptic_server.specification import EXACT_STICK
from realtime.stop import StopRequest

_FASTEST_M_PER_S = 2.0  # a fast stroke of a hand
# A mass on a spring whose end moves at V, from rest, goes up to 2 V: half the guard's limit leaves it below.
_SHARE_OF_LIMIT = 0.5


class Pointed:
    """The device `pointer`; `[device] plant` says what the hand holds."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._sampled = scene.device.plant == "phantom"

    def open(self) -> None:
        """Do nothing: it is always there."""

    def info(self) -> Info:
        """Sentences on what the hand holds and what it waits for."""
        words = "in a hand that follows the pointer of the technician's page"
        if self._sampled:
            return Info(
                simulated.specification_of(self._scene), (f"an arm as a PHANTOM Premium 1.5, {words}",)
            )
        return Info(EXACT_STICK, (f"the paper's stick itself, {words}",))

    def _lifted_m(self) -> float:
        return max(self._scene.stick.z_ss_m + self._scene.hand.gesture_height_m, LIFTED_M)

    def _hand(self) -> np.ndarray:
        scene, hand = self._scene, np.zeros(1, HAND)
        hand["wish"] = hand["lift"] = 1.0
        hand["height_m"] = scene.hand.gesture_height_m
        hand["stands_m"] = self._lifted_m()
        hand["fastest_m_per_s"] = min(_FASTEST_M_PER_S, _SHARE_OF_LIMIT * scene.guard.max_speed_m_per_s)
        return hand

    def attach_simulation(self, servo: Servo) -> Servo:
        """The servo with its hand, lifted, and the stick at rest there."""
        servo.block.follow_pointer()
        lifted_m = self._lifted_m()
        if not self._sampled:
            motion = servo.motion.copy()
            motion["z"], motion["v"] = lifted_m, 0.0
            return servo._replace(pointed=self._hand(), motion=motion)
        plant = simulated.arm_of(self._scene, self.info().specification)
        plant["z_m"] = plant["hand_m"] = self._scene.device.head_z_m + lifted_m
        return servo._replace(plant=plant, pointed=self._hand())

    def warm_up(self, spare: Servo) -> None:
        """Compile the loop and touch every path of it."""
        loop.warm_up(spare)

    def run(self, servo: Servo, stop: StopRequest) -> int:
        """Pace the ticks until asked to stop."""
        return paced.run(self.info().specification, servo, stop)

    def close(self) -> None:
        """Do nothing: no resource is held."""
