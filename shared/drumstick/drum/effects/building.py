"""A drum in the making: what an effect is told when its memory is laid out. Any thread."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from realtime.records import ABSENT

if TYPE_CHECKING:
    from drumstick.drum.membrane.lattice import Lattice
    from drumstick.drum.membrane.step_coefficients import StepCoefficients
    from drumstick.parameters.scene import Scene


Numbers = npt.NDArray[np.float64]
Gains = TypeVar("Gains", npt.NDArray[np.float32], npt.NDArray[np.float64])


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


class Separation(NamedTuple):
    """Sources that leave the mix: numbers of those taken; pans (sources, 2) of all; moved (sources, K): how much each
    hears too much of the modes that are moved on a mesh.
    """

    taken: Sequence[int]
    pans: Numbers
    moved: Numbers

    def of_corners(self, gains: Gains) -> tuple[Numbers, Gains]:
        """Gains (n, 2), as many rows for each source, parted: (n, 2 S) of those taken, and what the mix keeps."""
        of = np.arange(len(gains)) // max(len(gains) // max(len(self.pans), 1), 1)
        own, kept = np.zeros((len(gains), 2 * len(self.taken))), gains.copy()
        for stem, source in enumerate(self.taken):
            own[of == source, 2 * stem : 2 * stem + 2] = gains[of == source]
            kept[of == source] = 0.0
        return own, kept

    def split(self, each: Numbers) -> tuple[Numbers, Numbers]:
        """Parts of what each source hears, (sources, n): (2 S, n) of those taken, and (2, n) that the mix keeps."""
        own, kept = np.zeros((2 * len(self.taken), each.shape[1])), np.zeros((2, each.shape[1]))
        for source, heard in enumerate(each):
            panned_sound = np.outer(self.pans[source], heard)
            if source in self.taken:
                stem = self.taken.index(source)
                own[2 * stem : 2 * stem + 2] = panned_sound
            else:
                kept += panned_sound
        return own, kept
