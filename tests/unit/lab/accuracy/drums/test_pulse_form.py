"""The force that a strike's message gives the drum, beside the contact that the stick then makes.

Each shipped scene's own stick, hand, pulse and effects included, by the exact solver. The yardstick is the half-sine of
the same message, which is what was played before.
"""

import math

import numpy as np
import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.accuracy.drums import blows

RATE_HZ = 48_000
# Of the difference to the true force: what the damped pulse is held to, in dB.
HELD_TO = {
    "roll": -35.0, "cor-roll": -34.0, "tom": -22.0, "snare": -22.0, "timpani": -22.0, "phantom": -20.0,
    "paper-roll": -10.0, "delay-drum": -18.0,
}  # fmt: skip


def errors_dB(name: str) -> tuple[float, float]:  # noqa: N802
    """Errors of the damped pulse, and of the half-sine."""
    scene = parse(shipped_text(name), name)
    engine = new_engine(scene, RATE_HZ, StrikeRing())
    contact = blows.contact_of(scene, 30)
    told = contact.announced
    step_s = float(engine.control["divisor"][0] / engine.control["rate_Hz"][0])
    steps = math.ceil(told.contact_s / step_s) + 4
    ends_s = np.arange(steps + 1) * step_s
    true = np.diff(np.interp(ends_s, contact.t_s, contact.impulse_N_s)) / step_s
    blow = blows.OfflineStrike(0.0, 0.5, 0.0, told.peak_N, told.contact_s, told.impulse_N_s)
    damped, half_sine = (
        20.0
        * math.log10(
            np.linalg.norm(blows.message_forces(blow, engine, steps, is_damped) - true) / np.linalg.norm(true)
        )
        for is_damped in (True, False)
    )
    return damped, half_sine


@pytest.mark.parametrize("name", HELD_TO)
def test_a_message_is_the_contact_it_announces(name: str) -> None:
    damped, half_sine = errors_dB(name)
    assert damped < HELD_TO[name]
    assert damped < half_sine + 1.0
