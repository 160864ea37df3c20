"""The drum of a scene by the exact head: what it needs to know of the scene, read off its parameters alone. Any thread."""

import dataclasses
import math
from collections.abc import Iterable

from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.exact.head import Contact, Head, Numbers, blow, head, velocity

TOP_Hz = 20_000.0
_KNOWN = {"internal_loss"}


def head_of(scene: Scene) -> Head:
    """The scene's head up to TOP_Hz. ValueError where it has an effect that is not solved here."""
    effects = scene.drum.effects
    if set(effects) - _KNOWN:
        raise ValueError(f"no exact head has {', '.join(sorted(set(effects) - _KNOWN))}")
    loss = effects.get("internal_loss")
    high = None if loss is None else (loss.t60_s, loss.at_Hz)
    return head(scene.drum.f01_Hz, scene.drum.t60_s, TOP_Hz, high)


def sound(scene: Scene, strikes: Iterable[OfflineStrike], duration_s: float, rate_Hz: float) -> Numbers:
    """Left channel of its strikes, shape (n,), at a level of its own; raises as `head_of`."""
    stick = scene.stick
    damping = 0.5 / stick.m_kg
    law = Contact(
        damping * stick.r_in_N_s_per_m,
        damping * (stick.r_in_N_s_per_m - stick.r_out_N_s_per_m),
        stick.release == "paper",
    )
    blows = [blow(each.t_s, (each.x, each.y), each.contact_s, each.impulse_N_s, law) for each in strikes]
    pickups = [(math.cos((pan + 1.0) * math.pi / 4.0), (x, y)) for x, y, pan in scene.listen.pickups]
    return velocity(head_of(scene), blows, pickups, duration_s, rate_Hz)


def with_loss(scene: Scene, table: object) -> Scene:
    """The scene with [drum.effects.internal_loss] alone."""
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects={"internal_loss": table}))
