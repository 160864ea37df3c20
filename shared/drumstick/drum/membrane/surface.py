"""The head's surface as it is shown: heights on rings around the centre, whatever renders the head. Any thread.

On a mesh each place is the sum of the junctions around it by their nearness. A bank of modes is shown by its lowest
ones, whose shapes are summed by whoever shows them, not by the audio thread.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import AIR_KG_PER_M3
from drumstick.drum.membrane.interpolation import CORNERS, corners_of
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.membrane.sweep import Head
from drumstick.parameters.drum_effects import Cavity
from drumstick.parameters.scene import Scene

RINGS, SPOKES = 16, 48
_HIGHEST_ZERO = (
    24.0  # of the modes that are shown: waves down to a quarter of the radius, as the rings can show
)

Numbers = npt.NDArray[np.float64]


def rings() -> tuple[Numbers, Numbers]:
    """x and y in radii of what is shown, shape (1 + 16 * 48,): the centre, then ring by ring; the rim itself rests."""
    r = np.repeat(np.arange(1, RINGS + 1) / (RINGS + 1), SPOKES)
    angle = np.tile(2.0 * math.pi * np.arange(SPOKES) / SPOKES, RINGS)
    return np.append(0.0, r * np.cos(angle)), np.append(0.0, r * np.sin(angle))


class Places(NamedTuple):
    """Places of the displayed values in what renders the head, and their shares: shape (N, C). `shapes`: None, or
    (769, N) from values to heights."""

    places: npt.NDArray[np.int64]
    shares: npt.NDArray[np.float32]
    shapes: Numbers | None


def on_mesh(head: Head) -> Places:
    """Places on a mesh."""
    spacing = float(head.grid["spacing"][0])
    x, y = rings()
    places, shares = np.zeros((len(x), CORNERS), np.int64), np.zeros((len(x), CORNERS), np.float32)
    for i in range(len(x)):
        around, near = corners_of(head, float(x[i]), float(y[i]))
        # Nearer to the rim than the last junctions: straight down to the rim, which rests.
        fall = min(1.0, (1.0 - math.hypot(x[i], y[i])) / spacing)
        places[i, : len(around)], shares[i, : len(around)] = around, fall * np.array(near)
    return Places(places, shares, None)


def of_modes(highest_zero: float) -> Places:
    """Places on a bank of modes up to this zero: its lowest ones, those of cos(m phi), then those of sin(m phi)."""
    from drumstick.drum.modal.modes import modes_below, shapes_at

    all_of_them = len(modes_below(highest_zero).zeros)
    modes = modes_below(min(highest_zero, _HIGHEST_ZERO))
    count = len(modes.zeros)
    shapes = np.array(
        [np.concatenate(shapes_at(modes, float(x), float(y))) for x, y in zip(*rings(), strict=True)]
    )
    places = np.concatenate([np.arange(count), all_of_them + np.arange(count)])
    return Places(places[:, None], np.ones((2 * count, 1), np.float32), shapes)


def metres_per_unit(scene: Scene) -> float:
    """Metres for 1 of a renderer's displacement: it works with a tension of 1 N/m, a real head has sigma c^2.

    sigma is the head_kg_per_m2 of air or cavity, or the latter's default where the scene has none: a polyester head of
    0.2 mm. c is that of the head by itself where the scene has air, else by f01.
    """
    air = scene.drum.effects.get("air")
    if air is not None:
        from drumstick.drum.modal.air_load import speed_of

        return 1.0 / (air.head_kg_per_m2 * (speed_of(scene.drum) * scene.drum.radius_m) ** 2)
    cavity: Cavity = scene.drum.effects.get("cavity", Cavity())
    c_m_per_s = 2.0 * math.pi * scene.drum.f01_Hz * scene.drum.radius_m / J01
    return 1.0 / (cavity.head_kg_per_m2 * c_m_per_s**2)


# Of the air's mass on one side of a piston in a wall, to that of a layer as thick as its radius (Rayleigh, "The theory
# of sound", section 302).
_PISTON = 8.0 / (3.0 * math.pi)


def metres_per_unit_in_air(scene: Scene) -> float:
    """Metres for 1 of a renderer's displacement, on a head whose f01 is that in air.

    A head that sounds at f01 carries air along on both sides, as a piston in a wall does, and is so much tighter than
    `metres_per_unit` has it. A drum whose modes are those in air has that in them.
    """
    alone_m = metres_per_unit(scene)
    if "air" in scene.drum.effects:
        return alone_m
    head_kg_per_m2 = scene.drum.effects.get("cavity", Cavity()).head_kg_per_m2
    air_kg_per_m2 = 2.0 * _PISTON * AIR_KG_PER_M3 * scene.drum.radius_m
    return alone_m * head_kg_per_m2 / (head_kg_per_m2 + air_kg_per_m2)
