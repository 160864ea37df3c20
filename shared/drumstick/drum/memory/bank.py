"""A bank of modes."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.records import ABSENT

Floats = npt.NDArray[np.float32]


class Bank(NamedTuple):
    """Shapes, with P radial modes and 2 P oscillators: q, d, kept (R^2), stiffness (k), left and right (2 P,); orders
    (P,); radial (K, P): J_m(j r) times what a force of 1 N drives, at the radii r = (row - 1) / (K - 3); aimed (32,
    2 P), a row for each pulse of the pool, or mallet; turns (2, orders): cos and sin of m phi.

    What not every scene has, (2 P,): masses, for mallets: over what a force of 1 N drives; left_still and right_still,
    for microphones: gains of q, where left and right are those of d; lengths and tight, for tension: see
    drumstick.drum.modal.stretch.
    """

    q: Floats
    d: Floats
    kept: Floats
    stiffness: Floats
    left: Floats
    right: Floats
    orders: npt.NDArray[np.int64]
    radial: Floats
    aimed: Floats
    turns: npt.NDArray[np.float64]
    masses: Floats = ABSENT
    left_still: Floats = ABSENT
    right_still: Floats = ABSENT
    lengths: Floats = ABSENT
    tight: Floats = ABSENT
