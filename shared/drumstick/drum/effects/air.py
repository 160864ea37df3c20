"""`air`: each mode's air load and radiation, on both sides, for a bank of modes.

It only sets the modes' pitches, decays and shapes (drumstick.drum.modal.air_load): no cost while the drum plays. No
mesh has it yet: short waves move less air, but a junction's mass is the same for all.
"""

from dataclasses import dataclass
from typing import Literal

from drumstick.parameters.declare import choice, number
from drumstick.parameters.drum import HEAD_KG_PER_M2


@dataclass(frozen=True)
class AirTable:
    """Air on both sides of the head; for a bank of modes. f01_Hz includes it."""

    density_kg_per_m3: float = number(1.2, 0.0, 10.0, "kg/m^3", "Density of the air; 0: none")
    head_kg_per_m2: float = number(
        HEAD_KG_PER_M2, 0.05, 2.0, "kg/m^2", "Mass per area of the head alone; 0.26 is 0.19 mm of polyester"
    )
    baffle: Literal["endless", "none"] = choice(
        "endless",
        ("endless", "none"),
        "endless: an infinite baffle, the head's two sides do not cancel (timpani); none: their sound cancels round "
        "the rim, so low modes radiate less and ring longer (toms)",
    )


TABLE = AirTable
ON_MODES = True
ON_MESH = False
