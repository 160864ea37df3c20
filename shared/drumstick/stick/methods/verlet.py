"""Velocity Verlet; the damping, which depends on the new speed, is solved for.

Hairer, Lubich, Wanner, "Geometric numerical integration", section I.1.4. Kernel: any thread; no allocation.
"""

from drumstick.stick.segment import Segment, acceleration_at_start, pulse_acceleration_now
from realtime.kernels.jit import njit

ORDER = 2


@njit()
def step(seg: Segment, h: float) -> tuple[float, float]:
    """Position and speed h seconds into the segment."""
    start = acceleration_at_start(seg)
    z = seg.z + h * (seg.v + 0.5 * h * start)
    undamped = seg.g - seg.w2 * z + pulse_acceleration_now(seg.pulses, h)[0]
    return z, (seg.v + 0.5 * h * (start + undamped)) / (1.0 + h * seg.a)
