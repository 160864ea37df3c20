"""The limiter at the very output: no sum of drums exceeds full scale. Audio thread; no allocation."""

import math

import numpy as np
import numpy.typing as npt

from realtime.kernels.jit import njit

KNEE = 0.75  # up to here the limiter changes nothing


@njit()
def limited(x: float) -> float:
    """x up to 0.75, then bent smoothly (equal slope) so that |x| never exceeds 1."""
    size = abs(x)
    if size <= KNEE:
        return x
    bent = KNEE + (1.0 - KNEE) * math.tanh((size - KNEE) / (1.0 - KNEE))
    return math.copysign(bent, x)


@njit()
def limit(sound: npt.NDArray[np.float32]) -> None:
    """Every sample of `sound`, shape (n, channels), limited where it stands."""
    for i in range(sound.shape[0]):
        for channel in range(sound.shape[1]):
            sound[i, channel] = np.float32(limited(float(sound[i, channel])))
