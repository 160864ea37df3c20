"""The drum of a scene by the exact head, read off its parameters alone, and one that is played beside it. Any thread."""

import dataclasses
import math
from collections.abc import Iterable

import numpy as np

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.exact.differences import mode_by_mode
from drumstick_lab.accuracy.exact.head import Contact, Head, Numbers, blow, head, velocity

TOP_Hz = 20_000.0
MODES = 12  # the lowest twenty, where a pair counts twice
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


def one_blow(scene: Scene) -> OfflineStrike:
    """A blow of half its full scale at half radius, at once."""
    return strike_for_speed(scene, 0.5 * scene.strike.full_scale_m_per_s, 0.5, 0.0)


def mode_errors(
    scene: Scene, played: Scene, duration_s: float, rate_Hz: int
) -> tuple[Numbers, Numbers, Numbers]:
    """f_Hz of the lowest modes of the scene's head, and by how many cents and which part of its T60 each is off where
    `played` renders one blow on it; all (MODES,)."""
    strikes, exact = [one_blow(scene)], head_of(scene)
    f_Hz, t60_s = exact.f_Hz[:MODES], exact.t60_s[:MODES]
    heard = render(played, strikes, duration_s, rate_Hz)[:, 0]
    wanted = sound(scene, strikes, duration_s, rate_Hz)
    cents, decays = mode_by_mode(heard, wanted, f_Hz.tolist(), t60_s.tolist(), rate_Hz)
    return f_Hz, np.abs(cents), np.abs(decays)


def with_loss(scene: Scene, table: object) -> Scene:
    """The scene with [drum.effects.internal_loss] alone."""
    return dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, effects={"internal_loss": table}))
