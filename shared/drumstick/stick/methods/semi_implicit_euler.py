"""Semi-implicit (symplectic) Euler: first the speed, then the position with the new speed.

One evaluation a step; what most haptic and game loops do. Hairer, Lubich, Wanner, "Geometric numerical integration",
section I.1. Kernel: any thread; no allocation.
"""

from drumstick.stick.segment import Segment, acceleration_at_start
from realtime.kernels.jit import njit

ORDER = 1


@njit()
def step(seg: Segment, h: float) -> tuple[float, float]:
    """Position and speed h seconds into the segment."""
    v = seg.v + h * acceleration_at_start(seg)
    return seg.z + h * v, v
