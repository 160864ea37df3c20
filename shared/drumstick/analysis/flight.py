"""One flight above the head without pulses: what the hand gives back of the speed, the soft collision's alpha.

Any thread; blocks for microseconds once compiled.
"""

from typing import NamedTuple

import numpy as np

from drumstick import exact
from drumstick.analysis import lap
from drumstick.analysis.lap import Numbers
from drumstick.analysis.unpulsed import scratch_of, unpulsed_law
from drumstick.scene import Scene
from realtime.jit import Record, Records, njit


class Flight(NamedTuple):
    """alpha = |v_in| / v; seconds until the head is met again; how high the stick rises, m."""

    alpha: float
    duration_s: float
    apex_m: float


@njit()
def _fly(law: Record, scratch: Records, state: Numbers) -> tuple[int, float]:
    lap.place(law, scratch[1:], scratch[:1], state)
    return lap.until(law, scratch[0], exact.ENTRY, lap.PATIENCE, np.zeros(lap.TOLD_SIZE))


def flight(scene: Scene, v_m_per_s: float) -> Flight | None:
    """The flight that begins at z = 0 with this upward speed; None when the stick does not fly or never comes back.

    It does not fly at v <= 0: a pulse at exit into the head can leave a v_E that points down.
    """
    if not v_m_per_s > 0.0:
        return None
    scratch = scratch_of(scene)
    state = np.zeros(lap.STATE_SIZE)
    state[lap.V_OUT] = v_m_per_s
    fate, duration = _fly(unpulsed_law(scene)[0], scratch, state)
    if fate != exact.MOVING:
        return None
    return Flight(float(-scratch["v_in"][0] / v_m_per_s), float(duration), float(scratch["z_apex"][0]))
