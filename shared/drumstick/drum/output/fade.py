"""Fade of a drum in whose place another one has come: how long it rings on, and how it ends without a click.

A choke is that too: the other drum is one at rest, and nothing rings on.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

FADE_S = 0.06
CHOKE_S = 0.03  # of a drum that a hand takes hold of
RINGS_ON_S = 0.5  # before it fades, where the other one is of the same scene


class Leaving(NamedTuple):
    """Time for which a drum that leaves rings on, and then fades; both in s."""

    rings_on_s: float
    fade_s: float


REPLACED, CHOKED = Leaving(RINGS_ON_S, FADE_S), Leaving(0.0, CHOKE_S)


def levels_after(
    frames: int, first: int, rate_Hz: float, leaving: Leaving = REPLACED
) -> npt.NDArray[np.float32]:
    """Factors of `frames` samples, shape (frames, 1), the first of which comes `first` samples after the other drum."""
    since_s = (first + np.arange(frames)) / rate_Hz - leaving.rings_on_s
    share = np.clip(since_s / leaving.fade_s, 0.0, 1.0)
    return (0.5 + 0.5 * np.cos(np.pi * share)).astype(np.float32)[:, None]
