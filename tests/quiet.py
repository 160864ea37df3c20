"""What something costs where others use the machine too: the least of many looks, in turn with what it is beside."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

_LOOKS, _MOST = 40, 1000
_SETTLED, _FALLS = 20, 0.99  # none has been a hundredth less than before for so many looks


def least_seconds(windows: Sequence[Callable[[], float]]) -> npt.NDArray[np.float64]:
    """The least that each window took, in turn, shape (windows,): at least 40 looks, until 20 found nothing new.

    When it stops does not depend on which of them is less.
    """
    least = np.full(len(windows), np.inf)
    settled = 0
    for look in range(1, _MOST + 1):
        taken = np.array([window() for window in windows])
        settled = 0 if np.any(taken < _FALLS * least) else settled + 1
        least = np.minimum(least, taken)
        if look >= _LOOKS and settled >= _SETTLED:
            break
    return least
