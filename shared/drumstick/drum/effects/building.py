"""A drum in the making: what an effect is told when its memory is laid out. Any thread."""

from typing import TYPE_CHECKING, Any, NamedTuple

from realtime.records import ABSENT

if TYPE_CHECKING:
    from drumstick.drum.membrane.lattice import Lattice
    from drumstick.drum.membrane.step_coefficients import StepCoefficients
    from drumstick.parameters.scene import Scene


class Building(NamedTuple):
    """A drum in the making. unit_m: metres for 1 of its displacement, where an effect asks for them. lattice, numbers:
    of a mesh only. parts: of the effects before this one."""

    scene: "Scene"
    step_s: float
    unit_m: float
    lattice: "Lattice" = ABSENT
    numbers: "StepCoefficients" = ABSENT
    parts: "dict[str, Any]" = {}  # noqa: RUF012  never written to: `effects_of` gives its own
