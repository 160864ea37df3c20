"""Every cycle of period 1 and 2, stable or not, from the exact motion.

Not from a constant alpha: with the hand's real alpha(v) the direct alteration of the restitution, which equation (8)
calls unstable, can have a stable upper cycle. Any thread; blocks for some tenths of a second.
"""

import math

import numpy as np

from drumstick.analysis.cycles.cycle import Cycle, close
from drumstick.analysis.cycles.search import Search
from realtime.records import Records

# The speeds v_out that are scanned. After an almost critically damped contact hardly anything of the blow is left.
_SLOWEST_M_PER_S, _FASTEST_M_PER_S, _NODES = 1e-13, 1e4, 1021


def fixed_points(law: Records, scratch: Records) -> list[Cycle]:
    """Cycles of period 1 and 2 by increasing v_E, one entry an orbit. law: shape (1,), scratch: shape (2,)."""
    speeds = np.linspace(math.log(_SLOWEST_M_PER_S), math.log(_FASTEST_M_PER_S), _NODES)
    cycles: list[Cycle] = []
    for period in (1, 2):
        for state in Search(law, scratch, period).found(speeds):
            if any(cycle.passes(state) for cycle in cycles):
                continue
            cycle = close(law, scratch, state, period)
            if cycle is not None and not any(known.passes(cycle.states[0]) for known in cycles):
                cycles.append(cycle)
    return sorted(cycles, key=lambda cycle: cycle.v_e_m_per_s)
