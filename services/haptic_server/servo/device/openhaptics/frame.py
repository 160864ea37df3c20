"""The device's frame and the paper's.

Device: x to the right, y up, z toward the player, millimetres. Paper: x to the right, y away from the player, z up,
metres. Both are right-handed; a quarter turn about x takes one to the other. Any thread, the tick's too; no allocation.
"""

import numpy as np
import numpy.typing as npt

from haptic_server.records import Reading
from realtime.kernels.jit import njit

MM = 1e-3


@njit()
def to_paper(
    position_mm: npt.NDArray[np.float64], centre_mm: npt.NDArray[np.float64], reading: Reading
) -> None:
    """Write the device's position (3,) into the reading, from the middle of the workspace `centre_mm` (3,)."""
    reading.x_m = (position_mm[0] - centre_mm[0]) * MM
    reading.y_m = -(position_mm[2] - centre_mm[2]) * MM
    reading.z_m = (position_mm[1] - centre_mm[1]) * MM


@njit()
def to_device(force_N: float, out: npt.NDArray[np.float64]) -> None:
    """A force along the paper's z as the device's force vector (3,), N."""
    out[0] = 0.0
    out[1] = force_N
    out[2] = 0.0
