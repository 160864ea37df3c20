"""The servo's own fence: what a set must be before it is even asked whether it is safe.

A set comes from memory that another process writes, and the servo trusts nobody: the numbers that may be set live must
lie in the ranges of the parameter table, everything else in the record (a pulse's sign, a trigger, a release rule) must
be what the scene says, bit by bit. `fence_of` is for a control thread, `within` for the tick thread: no allocation, no
locks, no Python, no exceptions.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Z_H0, table_of
from drumstick.stick.law import DRUM, law_of
from realtime.kernels.jit import njit
from realtime.records import Record, Rows, dtype_of

FELT, HEARD = 1, 2  # what may be set live: by the stick, or only by those who hear the drum


class Fence(Record):
    """One row for each 8-byte word of a law's record, in its order; `live`: FELT, HEARD, or 0 if not to be set."""

    live: int
    low: float
    high: float
    word: int


FENCE = dtype_of(Fence)


def fence_of(scene: Scene) -> npt.NDArray[np.void]:
    """The fence of this scene's law, shape (n,): one row a word. Control thread."""
    law = law_of(scene)
    fence = np.zeros(law.dtype.itemsize // 8, FENCE)
    fence["word"] = law.view(np.int64)
    words = np.zeros(1, law.dtype)
    words.view(np.int64)[:] = np.arange(len(fence))  # each field of this record tells which word it is
    record: Any = words[0]
    for name, row in table_of(scene).items():
        if name != Z_H0:  # another view of z_ss
            at = np.asarray(row.part_of(record)[row.field]).view(np.int64)
            fence[at] = (HEARD if row.effect == DRUM else FELT, row.quantity.low, row.quantity.high, 0)
    return fence


@njit()
def within(fence: Rows[Fence], words: npt.NDArray[np.int64], numbers: npt.NDArray[np.float64]) -> bool:
    """True when this law, as words and as numbers (both shape (n,)), is one that its scene could have. NaN fails."""
    for at in range(fence.shape[0]):
        row = fence[at]
        if row.live != 0:
            if not row.low <= numbers[at] <= row.high:
                return False
        elif words[at] != row.word:
            return False
    return True


@njit()
def is_only_heard(
    fence: Rows[Fence], words: npt.NDArray[np.int64], other_words: npt.NDArray[np.int64]
) -> bool:
    """True when two laws differ, if at all, in what the stick does not feel. Both were `within`."""
    felt = 0
    for at in range(fence.shape[0]):
        felt += fence[at].live == FELT and words[at] != other_words[at]
    return felt == 0
