"""The implicit midpoint rule, solved in closed form because the segment is linear.

Never gains energy, whatever the step: Hairer, Lubich, Wanner, "Geometric numerical integration", section II.1. Kernel:
any thread; no allocation.
"""

from drumstick.stick.segment import Segment, pulse_acceleration_now
from realtime.kernels.jit import njit

ORDER = 2


@njit()
def step(seg: Segment, h: float) -> tuple[float, float]:
    """Position and speed h seconds into the segment."""
    half = 0.5 * h
    # v_mid = v + half (g - 2a v_mid - w2 z_mid + push), z_mid = z + half v_mid
    forcing = seg.g + pulse_acceleration_now(seg.pulses, half)[0] - seg.w2 * seg.z
    v_mid = (seg.v + half * forcing) / (1.0 + half * (2.0 * seg.a + half * seg.w2))
    return seg.z + h * v_mid, 2.0 * v_mid - seg.v
