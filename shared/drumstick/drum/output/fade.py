"""Fade of a drum in whose place another one has come: how long it rings on, and how it ends without a click."""

import numpy as np
import numpy.typing as npt

FADE_S = 0.06
RINGS_ON_S = 0.5  # before it fades, where the other one is of the same scene


def levels_after(frames: int, first: int, rate_Hz: float) -> npt.NDArray[np.float32]:
    """Factors of `frames` samples, shape (frames, 1), the first of which comes `first` samples after the other drum."""
    since_s = (first + np.arange(frames)) / rate_Hz - RINGS_ON_S
    share = np.clip(since_s / FADE_S, 0.0, 1.0)
    return (0.5 + 0.5 * np.cos(np.pi * share)).astype(np.float32)[:, None]
