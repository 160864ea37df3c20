"""What a throw ends in: a cycle, rest in the head, flight without return, or nothing that repeats.

Any thread; blocks for at most some tenths of a second.
"""

from typing import Literal, NamedTuple

import numpy as np

from drumstick import exact
from drumstick.analysis import lap
from drumstick.analysis.cycle import Cycle, close
from drumstick.analysis.lap import Numbers
from realtime.jit import Record, Records, njit

LONGEST_PERIOD = 8
_MOST_LAPS = 8192
_MOST_EFFORT = 300_000.0
_LOOK_EVERY = 64
_SETTLED = 1e-9
_NEAR = 1e-2

End = Literal["cycle", "captured", "left", "unsettled"]


class Settled(NamedTuple):
    """How the throw ends, and the cycle if it is one."""

    end: End
    cycle: Cycle | None


@njit()
def _distance(one: Numbers, other: Numbers) -> float:
    # Between two states, relative to the size of the first; the pulses' ages are not compared.
    apart, size = 0.0, 0.0
    for i in range(lap.PULSE_AGE):
        apart += abs(one[i] - other[i])
        size += abs(one[i])
    return apart / size


@njit()
def period_of(states: Numbers) -> int:
    """After how many of the last contacts these states, shape (n, 5), repeat; 0 when they do not."""
    last = states.shape[0] - 1
    for period in range(1, LONGEST_PERIOD + 1):
        same = True
        for i in range(last, period - 1, -1):
            if not _distance(states[i], states[i - period]) <= _SETTLED:
                same = False
                break
        if same:
            return period
    return 0


@njit()
def _play(law: Record, motions: Records, states: Numbers) -> int:
    # Carry motions[0] on; states, shape (n, 5), receives the last n contacts. Returns how it ended.
    told = np.zeros(lap.TOLD_SIZE)
    for _ in range(_MOST_LAPS // _LOOK_EVERY):
        for i in range(_LOOK_EVERY):
            fate = lap.next_release(law, motions[0], lap.PATIENCE, told)
            if fate != exact.MOVING:
                return fate
            kept = i - (_LOOK_EVERY - states.shape[0])
            if kept >= 0:
                lap.read(law, motions[0], states[kept])
        if period_of(states) > 0 or told[lap.EFFORT] > _MOST_EFFORT:
            return exact.MOVING
    return exact.MOVING


def settle(law: Records, scratch: Records, throw_m_per_s: float) -> Settled:
    """Throw the stick from z = 0 and play up to some thousand contacts."""
    states = np.zeros((4 * LONGEST_PERIOD, lap.STATE_SIZE))
    scratch[0] = scratch[1]
    scratch[0]["v"] = throw_m_per_s
    fate = _play(law[0], scratch[:1], states)
    if fate == exact.LEFT:
        return Settled("left", None)
    if fate != exact.MOVING:  # held down for thousands of oscillations is rest in the head, too
        return Settled("captured", None)
    period, last = period_of(states), states[-1]
    # A slow alternation about a stable cycle looks like twice its period; one that still approaches, like none at all.
    for candidate in range(1, (period or LONGEST_PERIOD) + 1):
        cycle = close(law, scratch, last, candidate)
        if cycle is not None and _near(cycle, last) and (cycle.stable or candidate == period):
            return Settled("cycle", cycle)
    return Settled("unsettled", None)


def _near(cycle: Cycle, state: Numbers) -> bool:
    return min(_distance(own, state) for own in cycle.states) <= _NEAR
