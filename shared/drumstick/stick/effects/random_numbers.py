"""Random numbers from a counter and a seed: a run can be repeated, and does not depend on how it is split. Kernels:
tick thread; no allocation.
"""

import numpy as np

from realtime.kernels.jit import njit

# The finaliser of splitmix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators" (2014).
_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_TO_UNIT = 2.0**-53


@njit()
def uniform(seed: int, index: int) -> float:
    """The index-th number of this seed's sequence, 0 <= u < 1."""
    x = (np.uint64(seed) << np.uint64(32)) + np.uint64(index) * _STEP
    x = (x ^ (x >> _30)) * _FIRST
    x = (x ^ (x >> _27)) * _SECOND
    x ^= x >> _31
    return float(x >> _11) * _TO_UNIT
