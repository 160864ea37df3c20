"""Microphones above a mesh."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]


class Microphones(NamedTuple):
    """M microphones. Shapes: runs (n, 4): microphone, first junction, last + 1, delay in steps; near and far (M, J):
    what a junction gives at its delay and a step later; line (M, a power of 2); gains (M, 2); at (1,): steps so far."""

    runs: npt.NDArray[np.int64]
    near: Floats
    far: Floats
    line: npt.NDArray[np.float64]
    gains: npt.NDArray[np.float64]
    at: npt.NDArray[np.int64]
