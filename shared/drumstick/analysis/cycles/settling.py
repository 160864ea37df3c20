"""End of a throw: a cycle, rest in the head, flight without return, or nothing that repeats.

Any thread; blocks for at most some tenths of a second.
"""

from typing import Literal, NamedTuple

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.cycle import Cycle, close
from drumstick.analysis.cycles.return_step import Numbers
from drumstick.stick.motion import exact
from realtime.records import Records

MAX_PERIOD = 8
_MAX_LAPS = 8192
_MAX_EFFORT = 300_000.0
_AT_ONCE, _COMPARED = 64, 4 * MAX_PERIOD
_SETTLED = 1e-9
_NEAR = 1e-2

End = Literal["cycle", "captured", "left", "unsettled"]


class Settled(NamedTuple):
    """End of the throw, and the cycle if it is one."""

    end: End
    cycle: Cycle | None


def _distance(one: Numbers, other: Numbers) -> float:
    # Between two states, relative to the size of the first; the pulses' ages are not compared.
    apart = np.abs(one[: return_step.PULSE_AGE] - other[: return_step.PULSE_AGE]).sum()
    return float(apart / np.abs(one[: return_step.PULSE_AGE]).sum())


def _period_of(states: Numbers) -> int:
    # After how many of these contacts, shape (n, 5), the states repeat; 0 when they do not.
    for period in range(1, MAX_PERIOD + 1):
        pairs = zip(states[period:], states[:-period], strict=True)
        if all(_distance(later, earlier) <= _SETTLED for later, earlier in pairs):
            return period
    return 0


def settle(law: Records, scratch: Records, throw_m_per_s: float) -> Settled:
    """Throw the stick from z = 0 and play up to some thousand contacts."""
    scratch[0] = scratch[1]
    scratch[0]["v"] = throw_m_per_s
    return settle_on(law, scratch)


def settle_on(law: Records, scratch: Records) -> Settled:
    """Play up to some thousand contacts more from where the stick is in scratch[0]."""
    states, measured = (
        np.zeros((_AT_ONCE, return_step.STATE_SIZE)),
        np.zeros((_AT_ONCE, return_step.MEASURED_SIZE)),
    )
    period = 0
    for _ in range(_MAX_LAPS // _AT_ONCE):
        outcome = return_step.iterate(law[0], scratch[0], states, return_step.MAX_WAIT_DOUBLINGS, measured)
        if outcome == exact.LEFT:
            return Settled("left", None)
        if outcome != exact.MOVING:  # held down for thousands of oscillations is rest in the head, too
            return Settled("captured", None)
        period = _period_of(states[-_COMPARED:])
        if period > 0 or measured[:, return_step.EFFORT].sum() > _MAX_EFFORT:
            break
    last = states[-1]
    # A slow alternation about a stable cycle looks like twice its period; one that still approaches, like none at all.
    for candidate in range(1, (period or MAX_PERIOD) + 1):
        cycle = close(law, scratch, last, candidate)
        if cycle is not None and _near(cycle, last) and (cycle.stable or candidate == period):
            return Settled("cycle", cycle)
    return Settled("unsettled", None)


def _near(cycle: Cycle, state: Numbers) -> bool:
    return min(_distance(own, state) for own in cycle.states) <= _NEAR
