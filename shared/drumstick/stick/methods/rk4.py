"""The classical Runge-Kutta method of order four. Hairer, Norsett, Wanner, "Solving ODEs I", table II.1.2.

Kernel: any thread; no allocation.
"""

from drumstick.stick.segment import Segment, acceleration, acceleration_at_start
from realtime.kernels.jit import njit

ORDER = 4


@njit()
def step(seg: Segment, h: float) -> tuple[float, float]:
    """Position and speed h seconds into the segment."""
    half = 0.5 * h
    v1 = seg.v
    a1 = acceleration_at_start(seg)
    v2 = seg.v + half * a1
    a2 = acceleration(seg, half, seg.z + half * v1, v2)
    v3 = seg.v + half * a2
    a3 = acceleration(seg, half, seg.z + half * v2, v3)
    v4 = seg.v + h * a3
    a4 = acceleration(seg, h, seg.z + h * v3, v4)
    return (
        seg.z + h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4),
        seg.v + h / 6.0 * (a1 + 2.0 * (a2 + a3) + a4),
    )
