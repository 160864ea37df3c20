"""A bank of modes."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.records import ABSENT

Floats = npt.NDArray[np.float32]


class Bank(NamedTuple):
    """Shapes, with P radial modes and 2 P oscillators: q, d, r_squared (R^2), stiffness (k), left and right (2 P,);
    orders (P,); radial (K, P): J_m(j r) times what a force of 1 N drives, at the radii r = (row - 1) / (K - 3);
    strike_weights (32, 2 P), a row for each pulse of the pool, or mallet; angular (2, orders): cos and sin of m phi.

    What not every scene has, (2 P,): masses, for mallets: over what a force of 1 N drives; left_by_displacement and
    right_by_displacement, for microphones: gains of q, where left and right are those of d; stretch_weights (l) and
    tension_stiffness (r k/R^2), for tension: see drumstick.drum.modal.stretch.
    """

    q: Floats
    d: Floats
    r_squared: Floats
    stiffness: Floats
    left: Floats
    right: Floats
    orders: npt.NDArray[np.int64]
    radial: Floats
    strike_weights: Floats
    angular: npt.NDArray[np.float64]
    masses: Floats = ABSENT
    left_by_displacement: Floats = ABSENT
    right_by_displacement: Floats = ABSENT
    stretch_weights: Floats = ABSENT
    tension_stiffness: Floats = ABSENT
