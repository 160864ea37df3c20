"""Sounds that leave a drum by output pairs of their own, beside its mix."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt


class Stems(NamedTuple):
    """S pairs, 2 S channels, of single pickups or microphones. Gains of each channel, for what is heard of the head:
    by microphones (M, 2 S), by the corners of pickups (C P, 2 S), by those on a second head (D, 2 S), of the modes that
    are moved on a mesh (2 S, K), and of the oscillators of a bank, by movement and by place (2 S, N).
    now (2 S,): sums of the present step; history (2 S, 2 TAPS): as that of the mix."""

    microphones: npt.NDArray[np.float64]
    pickups: npt.NDArray[np.float64]
    second: npt.NDArray[np.float64]
    moved: npt.NDArray[np.float64]
    movement: npt.NDArray[np.float32]
    place: npt.NDArray[np.float32]
    now: npt.NDArray[np.float64]
    history: npt.NDArray[np.float32]
