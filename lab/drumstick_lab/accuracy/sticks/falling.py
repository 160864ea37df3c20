"""Speed that a rendered head gives back to an arm that falls on it, beside the design's.

A simulated arm of the plant `phantom` (0.03 mm encoders, held force, no hand, no friction) falls at SPEED, at PHASES
phases of the tick, without the guard's passivity control and with it. The design is the closed form of a head that only
pushes; the theory of lag puts R_eff = R_in - K_coll (T/2 + t_d - lead) into it (docs/servo.md). Any thread; blocks for
milliseconds once compiled.
"""

from typing import NamedTuple

import numpy as np

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import Refusal
from drumstick.stick import contact
from drumstick.stick.law import law_of
from drumstick_lab.accuracy.sticks.filters import ADAPTIVE, fall, filter_of
from haptic_server import block as blocks
from haptic_server.limits import limits_of
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory

M_KG, R_IN, SPEED = 0.075, 2.5, 0.3  # kg, N s/m, m/s
PHASES = 32
PREDICTORS = ("off", "lead")

_SCENE = """
[stick]
m_kg = {m}
k_coll_N_per_m = {k}
r_in_N_s_per_m = {r}
k_hand_N_per_m = {k_hand}
r_out_N_s_per_m = {r_out}
z_ss_m = {z_ss}
release = "unilateral"
[servo]
rate_Hz = {rate}
predictor = "{predictor}"
[device]
plant = "phantom"
delay_ticks = {delay}
friction_N = 0.0
[hand]
gesture = "{gesture}"
"""
_NO_HAND = {"k_hand": 0.0, "r_out": 0.0, "z_ss": 0.0, "gesture": "hold"}
_STROKING_HAND = {"k_hand": 60.0, "r_out": 0.5, "z_ss": -0.01, "gesture": "strokes"}


class Sampled(NamedTuple):
    """A head (N/m) on a sampled device: ticks a second, ticks of its own delay, `off` or `lead`."""

    k_coll: float
    rate_Hz: int
    delay_ticks: int
    predictor: str

    def scene(self, strokes: bool = False) -> Scene:
        """The arm alone, or in a hand that strokes the head twice a second."""
        hand = _STROKING_HAND if strokes else _NO_HAND
        return parse(
            _SCENE.format(
                m=M_KG, k=self.k_coll, r=R_IN, rate=self.rate_Hz, delay=self.delay_ticks,
                predictor=self.predictor, **hand,
            ),
            "fall",
        )  # fmt: skip


def servo_of(scene: Scene) -> memory.Servo:
    """The servo of the scene's simulated arm, for virtual time."""
    device = Simulated(scene)
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


def rebounds(scene: Scene, guarded: bool, kind: str = ADAPTIVE, phases: int = PHASES) -> list[float]:
    """Restitution at each phase of the tick; negative where the arm does not come back."""
    servo = servo_of(scene)
    record = filter_of(kind, 1.0 / scene.servo.rate_Hz)[0]
    return [fall(servo, record, SPEED, phase / phases, guarded) for phase in range(phases)]


def spread(values: list[float]) -> dict[str, float]:
    """Their mean, least and most."""
    return {"mean": float(np.mean(values)), "least": min(values), "most": max(values)}


def passes(scene: Scene) -> bool:
    """True when the envelope lets this set play on this device."""
    try:
        envelope.require(law_of(scene), limits_of(scene, Simulated(scene).info().specification))
    except Refusal:
        return False
    return True


def design(k_coll: float) -> float:
    """The restitution that the head is to have."""
    return float(contact.beta_unilateral(M_KG, k_coll, R_IN))


def theory(k_coll: float, lag_s: float) -> float | None:
    """Restitution with R_eff in the closed form; None where R_eff is negative, which that form does not know."""
    effective = R_IN - k_coll * lag_s
    return float(contact.beta_unilateral(M_KG, k_coll, effective)) if effective >= 0.0 else None


def ticks_in_contact(k_coll: float, rate_Hz: int) -> float:
    """Length of the design's contact in ticks."""
    return float(contact.contact_time(contact.UNILATERAL, M_KG, k_coll, R_IN) * rate_Hz)
