"""Sweep of a mesh that two threads share: what the second must know of a step, and which parts of it are taken."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.sweep import Head

PARTS = 8
# Cells, apart by two cache lines: how many parts of the newest step are taken; how many the second thread has done; 1
# when it is to end.
TAKEN, DONE, STOP = 0, 16, 32
# TAKEN counts the audio thread's parts in its low bits, the second thread's above them; each one too many at most.
SECOND_ONE = 16
FIRST_MASK = SECOND_ONE - 1


class SharedSweep(NamedTuple):
    """cells (33,), by atomic instructions only; q (1,): by how much the tension is raised in the step; sums (PARTS,):
    of each part's u+, where a second head asks; strips (PARTS + 1,): each part's first strip, and the end."""

    cells: npt.NDArray[np.int64]
    q: npt.NDArray[np.float64]
    sums: npt.NDArray[np.float64]
    strips: npt.NDArray[np.int64]


def shared_sweep_of(head: Head) -> SharedSweep:
    """Nothing taken yet; parts of as many junctions each as strips allow."""
    ends = np.cumsum(head.strips[:, 3] - head.strips[:, 0])
    at: npt.NDArray[np.float64] = ends[-1] * np.arange(PARTS + 1) / PARTS
    strips = np.array(np.searchsorted(ends, at), np.int64)
    strips[-1] = len(ends)
    cells = np.zeros(STOP + 1, np.int64)
    cells[TAKEN] = PARTS
    return SharedSweep(cells, np.zeros(1), np.zeros(PARTS), strips)
