"""Speed at which a stick above the head can meet it at most, by what its hand's spring and running pulses still add.

To be compared with `drumstick.safety.envelope.Judgement.max_entry_speed`. Kernels: tick thread or any other; no
allocation.
"""

import math

from drumstick.safety import bounds
from drumstick.stick import composition
from drumstick.stick.records import Law, Motion
from realtime.kernels.jit import njit


@njit()
def entry_speed(law: Law, z: float, v: float) -> float:
    """The fastest that a stick at z >= 0 m and v m/s can meet the head, m/s.

    A low or firm hand turns height into speed. Pulses that still run come on top.
    """
    return entry_speed_to(law, z, v, law.z_ss)


@njit()
def entry_speed_to(law: Law, z: float, v: float, z_ss: float) -> float:
    """Like `entry_speed`, of a hand that holds its spring at `z_ss` m."""
    w2 = law.k_hand / law.m
    squared = v * v + w2 * (z - z_ss) ** 2
    if z_ss < 0.0:
        squared -= w2 * z_ss * z_ss  # the head is met at z = 0, before the spring is at rest
    return math.sqrt(max(squared, 0.0))


@njit()
def speed_ahead(law: Law, motion: Motion, z_ss: float, pulses: float) -> float:
    """The fastest that the flight of `motion` can meet the head, m/s, by a hand that holds its spring at `z_ss` m.

    pulses: what running ones still have to give, m/s. A flight that gains may grow on (drumstick.safety.bounds).
    """
    growth = composition.flight_growth(law, motion)
    if growth == 1.0:
        return entry_speed_to(law, motion.z, motion.v, z_ss) + pulses
    w = math.sqrt(law.k_hand / law.m)
    hand, amplitude = w * abs(z_ss), math.hypot(motion.v, w * (motion.z - z_ss))
    if z_ss <= 0.0 and pulses == 0.0:
        amplitude *= growth  # it is within half a swing of the head
    else:
        amplitude = bounds.grown_amplitude(growth, max(amplitude, hand), pulses)
    return math.sqrt(max(amplitude * amplitude - hand * hand, 0.0))
