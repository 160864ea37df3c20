"""Display data of a drum, while somebody looks."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from realtime.records import Record, Rows, dtype_of


class DisplayRate(Record):
    """`due`: device frames until the next copy; `rested`: 1 when a head at rest was shown."""

    due: int
    rested: int


PACE = dtype_of(DisplayRate)


class DisplayBuffers(NamedTuple):
    """Shapes, with N values shown and C corners of each: requested and cells (24,), slots (3, N), places and shares
    (N, C), heard (32768,), pace (1,). A value is the sum of what the head holds at its places by their shares.
    """

    requested: npt.NDArray[np.int64]
    cells: npt.NDArray[np.int64]
    slots: npt.NDArray[np.float32]
    places: npt.NDArray[np.int64]
    shares: npt.NDArray[np.float32]
    heard: npt.NDArray[np.float32]
    pace: Rows[DisplayRate]
