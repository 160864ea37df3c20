"""A peer's modes by its impulse response: peaks of the spectrum near the ratios that its membrane would ideally have.

Each peer is held to the membrane that it is a mesh of. STK's edges give waves back as they come, which is a square with
free edges: f ~ sqrt(m^2 + n^2), m and n from 0 on, not both. SuperCollider's circle is struck and heard at its centre,
where of the first twenty modes only the three round ones sound. Faust's example joins its edges in another order than
that in which they come out of the mesh: that is no membrane's boundary, and nothing is said of its modes.
"""

import itertools
import math

import numpy as np
import numpy.typing as npt

from drumstick.drum.modal.modes import modes_below
from drumstick_lab.accuracy.drums.modes import MODES

Numbers = npt.NDArray[np.float64]
MAX_CENTS = 300.0  # beyond, a mode counts as missing
_FLOOR = 1e-3  # of the strongest peak
_PADDED = 4


def free_square() -> list[float]:
    """The first twenty ratios, pairs twice."""
    some = range(MODES)
    return sorted(math.hypot(m, n) for m, n in itertools.product(some, some) if (m, n) != (0, 0))[:MODES]


def round_modes() -> list[float]:
    """Modes among the circle's first twenty that have no node at the centre."""
    modes = modes_below(12.0)
    before = 0
    found: list[float] = []
    for m, zero in zip(modes.orders.tolist(), modes.zeros.tolist(), strict=True):
        if m == 0 and before < MODES:
            found.append(zero / float(modes.zeros[0]))
        before += 1 if m == 0 else 2
    return found


def _peaks(sound: Numbers, rate_Hz: float) -> Numbers:
    # Hz, rising; between two lines of the spectrum by the parabola through the levels of three.
    length = _PADDED * len(sound)
    level = np.log(np.abs(np.fft.rfft(sound * np.hanning(len(sound)), length)) + 1e-300)
    first = _PADDED * 4  # what is constant is no mode
    middle = level[first:-1]
    high = (middle > level[first - 1 : -2]) & (middle >= level[first + 1 :])
    at = np.flatnonzero(high & (middle > middle.max() + math.log(_FLOOR))) + first
    before, here, after = level[at - 1], level[at], level[at + 1]
    return (at + 0.5 * (before - after) / (before - 2.0 * here + after)) * rate_Hz / length


def cents_heard(sound: Numbers, rate_Hz: float, ratios: list[float]) -> Numbers:
    """Error of each mode that is found, relative to the lowest peak; as many as are found, none of silence."""
    peaks = _peaks(sound, rate_Hz)
    if not len(peaks):
        return np.empty(0)
    off = 1200.0 * np.log2(peaks[None, :] / peaks[0] / np.array(ratios)[:, None] * ratios[0])
    nearest = off[np.arange(len(ratios)), np.argmin(np.abs(off), axis=1)]
    return nearest[np.abs(nearest) <= MAX_CENTS]
