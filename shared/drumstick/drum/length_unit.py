"""The unit of a renderer's displacement, in metres. Any thread."""

import math

from drumstick.drum.air_constants import AIR_KG_PER_M3
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.modal.air_load import is_in_air, speed_of
from drumstick.parameters.drum import HEAD_KG_PER_M2, Drum
from drumstick.parameters.scene import Scene


def _head_kg_per_m2(drum: Drum) -> float:
    told = (getattr(table, "head_kg_per_m2", None) for table in drum.effects.values())
    return next((sigma for sigma in told if sigma is not None), HEAD_KG_PER_M2)


def metres_per_unit(scene: Scene) -> float:
    """Metres for 1 of a renderer's displacement: it works with a tension of 1 N/m, a real head has sigma c^2.

    sigma is the head_kg_per_m2 of an effect that has one, or that of a usual head. c is that of the head by itself
    where the scene has air, else by f01.
    """
    if is_in_air(scene.drum):
        return 1.0 / (_head_kg_per_m2(scene.drum) * (speed_of(scene.drum) * scene.drum.radius_m) ** 2)
    c_m_per_s = 2.0 * math.pi * scene.drum.f01_Hz * scene.drum.radius_m / J01
    return 1.0 / (_head_kg_per_m2(scene.drum) * c_m_per_s**2)


# Of the air's mass on one side of a baffled piston, to that of a layer as thick as its radius (Rayleigh, "The theory
# of sound", section 302).
_PISTON = 8.0 / (3.0 * math.pi)


def metres_per_unit_in_air(scene: Scene) -> float:
    """Metres for 1 of a renderer's displacement, on a head whose f01 is that in air.

    A head that sounds at f01 carries air along on both sides, as a baffled piston does, and is so much tighter than
    `metres_per_unit` has it. A drum whose modes are those in air has that in them.
    """
    alone_m = metres_per_unit(scene)
    if is_in_air(scene.drum):
        return alone_m
    head_kg_per_m2 = _head_kg_per_m2(scene.drum)
    air_kg_per_m2 = 2.0 * _PISTON * AIR_KG_PER_M3 * scene.drum.radius_m
    return alone_m * head_kg_per_m2 / (head_kg_per_m2 + air_kg_per_m2)
