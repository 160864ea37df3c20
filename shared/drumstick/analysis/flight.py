"""One flight above the head without pulses: what the hand gives back of the speed, the soft collision's alpha.

Any thread; blocks for microseconds once compiled.
"""

from typing import NamedTuple

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.unpulsed import repeating, unpulsed_law
from drumstick.parameters.scene import Scene
from drumstick.stick.law import thrown
from drumstick.stick.motion import exact


class Flight(NamedTuple):
    """alpha = |v_in| / v; seconds until the head is met again; how high the stick rises, m."""

    alpha: float
    duration_s: float
    apex_m: float


def flight(scene: Scene, v_m_per_s: float) -> Flight | None:
    """The flight that begins at z = 0 with this upward speed; None when the stick does not fly or never comes back.

    It does not fly at v <= 0: a pulse at exit into the head can leave a v_E that points down.
    """
    if not v_m_per_s > 0.0:
        return None
    motion = thrown(repeating(scene), v_m_per_s)
    measured = np.zeros(return_step.MEASURED_SIZE)
    outcome, duration = return_step.until(
        unpulsed_law(scene)[0], motion[0], exact.ENTRY, return_step.MAX_WAIT_DOUBLINGS, measured
    )
    if outcome != exact.MOVING:
        return None
    return Flight(float(-motion["v_in"][0] / v_m_per_s), float(duration), float(motion["z_apex"][0]))
