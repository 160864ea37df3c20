"""A drum in the making: what an effect is told when its memory is laid out. Any thread."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.records import ABSENT

if TYPE_CHECKING:
    from drumstick.drum.membrane.lattice import Lattice
    from drumstick.drum.membrane.step_coefficients import StepCoefficients
    from drumstick.parameters.scene import Scene


class MovedModes(NamedTuple):
    """Modes of a mesh that are moved to another pitch and decay, N, by pushes on P places.

    places (P,): junctions in the flat array; dual (N, P): turns heights there into amplitudes a, and pushes of modes
    into pushes there; stiffness (N, N) and loss (N,): a step pushes the modes by stiffness a - loss (a - a-); heard
    (2, N): what pickups hear too much of each a, left and right. Filled up to whole vectors with some that do nothing.
    """

    places: npt.NDArray[np.int64]
    dual: npt.NDArray[np.float32]
    stiffness: npt.NDArray[np.float32]
    loss: npt.NDArray[np.float32]
    heard: npt.NDArray[np.float64]


class Building(NamedTuple):
    """A drum in the making. unit_m: metres for 1 of its displacement, where an effect asks for them. lattice, numbers,
    moved: of a mesh only. parts: of the effects before this one."""

    scene: "Scene"
    step_s: float
    unit_m: float
    lattice: "Lattice" = ABSENT
    numbers: "StepCoefficients" = ABSENT
    moved: MovedModes = ABSENT
    parts: "dict[str, Any]" = {}  # noqa: RUF012  never written to: `effects_of` gives its own
