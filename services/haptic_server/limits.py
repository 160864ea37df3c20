"""The limits of the envelope for a scene on its device: one text for gateway and servo. Control threads."""

from drumstick.envelope import Limits
from drumstick.scene import Scene
from haptic_server.device.specification import EXACT_STICK, PREMIUM_1_5, Specification


def specification_of(scene: Scene) -> Specification:
    """The simulated device that the scene asks for."""
    return PREMIUM_1_5 if scene.device.plant == "phantom" else EXACT_STICK


def lag_s(scene: Scene) -> float:
    """Mean age of a sampled device's force: half a period and the device's own delay."""
    return (0.5 + scene.device.delay_ticks) / scene.servo.rate_Hz


def limits_of(scene: Scene, specification: Specification) -> Limits:
    """What the scene's guard and the device allow, whichever is tighter: a scene never raises a device's limits."""
    force = min(scene.guard.max_force_N, specification.max_force_N)
    if specification is EXACT_STICK:
        return Limits(force, scene.guard.max_speed_m_per_s)
    return Limits(force, scene.guard.max_speed_m_per_s, specification.stiffness_N_per_m, lag_s(scene))
