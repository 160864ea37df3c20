"""Clicks in a sound, for tests that change something while a drum rings."""

import numpy as np
import numpy.typing as npt


def roughness(sound: npt.NDArray[np.float64]) -> float:
    """Size of the largest click in it."""
    # A click is a jump, in the sound or in its slope: the third difference shows it far above a drum's own.
    return float(np.abs(np.diff(sound, n=3)).max())
