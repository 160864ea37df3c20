"""Basins: which end each strike speed leads to, and how much a roll withstands.

A strike meets the head at z = 0 with a downward speed; what follows is played by the exact motion until it is at one of
the known cycles, at rest in the head, or gone. Speeds are scanned, and where two neighbours end differently the edge
between them is narrowed by bisection. What a scan alone would miss is looked for by the return map: where it turns
(an extremum between nodes), and where two neighbours of one end pass over a range of another (a preimage of it).

Any thread; blocks for some tenths of a second; the work is bounded.
"""

import itertools
import math
from bisect import bisect
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drumstick.analysis.cycles import return_step
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.cycles.return_step import COR_PULSE, EFFORT, PULSE, V_IN, V_OUT, Numbers
from drumstick.analysis.cycles.settling import End, settle_on
from drumstick.stick.motion import exact
from realtime.records import Records

_AT_ONCE, _LAPS = (
    32,
    48,
)  # contacts after one strike; one that is nowhere then goes on in `settle_on`, a few times
_SETTLE_ON = 2
_NEAR, _NEAR_OTHERS = 1e-4, 0.1  # of the cycle's speed; of the distance to the nearest other cycle
_NODES, _COARSEST = 257, 16
_SCAN_EFFORT, _EFFORT, _MOST_EFFORT = (
    60_000.0,
    600_000.0,
    20_000.0,
)  # of all and of one strike; events, some 5 us each
_EDGE = 1e-10  # relative width at which an edge is found
_TURN_STEPS, _PREIMAGE_STEPS, _ROUNDS = 16, 24, 8
_FORGOTTEN = 1e-12  # of the strike's speed: what is left of a pulse and may be left out
SLOWEST_M_PER_S = 1e-9  # slower is no strike: a stick that comes to rest at z = 0 has no slowest one
_FARTHEST_LIMIT = 1e-2  # of a roll's own strike: from here to its inverse a limit is sought
_GOLDEN = 0.3819660112501051

# Indices of cycles are 0 and more.
_REST, _AWAY, _NOWHERE = -1, -2, -3
_ENDS: dict[int, End] = {_REST: "captured", _AWAY: "left", _NOWHERE: "unsettled"}


@dataclass(frozen=True)
class Basin:
    """A range of strike speeds, m/s, with one end. cycle: the roll that they end in, None for any other end."""

    from_m_per_s: float
    to_m_per_s: float
    end: End
    cycle: Cycle | None


@dataclass(frozen=True)
class Withstands:
    """The slowest and the fastest strike, m/s, from which a roll still comes back; None where no limit was found.

    strike_m_per_s: the roll's own. It is replaced once by a slower or faster one; what is left of earlier pulses stays
    as in the roll. cycle: the roll; where it has several strikes, these numbers are of the one most easily broken.
    """

    cycle: Cycle
    strike_m_per_s: float
    slowest_m_per_s: float | None
    fastest_m_per_s: float | None

    @property
    def least_m_per_s(self) -> float | None:
        """The smallest change of one strike's speed, m/s, that breaks the roll; None when none does."""
        limits = (self.slowest_m_per_s, self.fastest_m_per_s)
        return min((abs(limit - self.strike_m_per_s) for limit in limits if limit is not None), default=None)


class _Strikes:
    # Strikes of any speed, with the same rest of earlier pulses; `cycles` grows by the rolls of longer period met.
    def __init__(self, law: Records, scratch: Records, cycles: list[Cycle], pushes: Numbers) -> None:
        self._law, self._scratch, self._pushes = law, scratch, pushes
        self.cycles = cycles
        self._states = np.zeros((_AT_ONCE, return_step.STATE_SIZE))
        self._measured = np.zeros((_AT_ONCE, return_step.MEASURED_SIZE))
        self._settled_on = 0
        self._known: dict[float, tuple[int, float]] = {}
        self._targets()

    @property
    def effort(self) -> float:
        return float(self._measured[:, EFFORT].sum())

    def at(self, speed: float) -> tuple[int, float]:
        """The end, and the speed of the next strike (NaN without)."""
        if speed not in self._known:
            self._known[speed] = self._played(speed)
        return self._known[speed]

    def _played(self, speed: float) -> tuple[int, float]:
        start = self._pushes.copy()
        start[V_OUT] = -speed
        return_step.set_state(self._law[0], self._scratch[1:], self._scratch[:1], start)
        following, before = math.nan, self.effort
        for lap in range(_LAPS):
            self._states[:], self._measured[:, V_IN] = 0.0, math.nan
            outcome = return_step.iterate(
                self._law[0], self._scratch[0], self._states, return_step.MAX_WAIT_DOUBLINGS, self._measured
            )
            if lap == 0:
                following = -float(self._measured[1, V_IN])
            if outcome != exact.MOVING:  # held down for thousands of oscillations is rest in the head, too
                return (_AWAY if outcome == exact.LEFT else _REST), following
            here = self._reached()
            if here is not None:
                return here, following
            if self.effort > before + _MOST_EFFORT:
                break
        if self._settled_on >= _SETTLE_ON or self.effort > _EFFORT:
            return _NOWHERE, following
        self._settled_on += 1
        return self._further(), following

    def _reached(self) -> int | None:
        # The cycle that the last strikes are at, twice around: an age that only looks right does not come round.
        states, owners, near = self._stable
        for index in dict.fromkeys(owners):
            last = self._states[-1 - 2 * self.cycles[index].period :, : return_step.PULSE_AGE]
            own = owners == index
            apart = np.abs(last[:, None] - states[None, own, : return_step.PULSE_AGE]).sum(axis=2)
            if np.all(np.any(apart <= near[own], axis=1)):
                return index
        return None

    def _further(self) -> int:
        settled = settle_on(self._law, self._scratch)
        if settled.cycle is None:
            return next((code for code, end in _ENDS.items() if end == settled.end), _NOWHERE)
        for index, cycle in enumerate(self.cycles):
            if cycle.passes(settled.cycle.states[0]):
                return index
        self.cycles.append(settled.cycle)
        self._targets()
        return len(self.cycles) - 1

    def _targets(self) -> None:
        states = [np.zeros((0, return_step.STATE_SIZE))]
        owners: list[int] = []
        near: list[float] = []
        for index, cycle in enumerate(self.cycles):
            if cycle.stable:
                others = [c.states for c in self.cycles if c is not cycle]
                states.append(cycle.states)
                owners += [index] * cycle.period
                near += [_near(state, others) for state in cycle.states]
        self._stable = np.concatenate(states), np.array(owners, np.int64), np.array(near, np.float64)


def _near(state: Numbers, others: Sequence[Numbers]) -> float:
    # So near to this state of a stable cycle the stick is caught, m/s.
    kept = slice(0, return_step.PULSE_AGE)
    apart = (float(np.abs(o[:, kept] - state[kept]).sum(axis=1).min()) for o in others)
    return min(_NEAR * float(np.abs(state[kept]).sum()), _NEAR_OTHERS * min(apart, default=math.inf))


def _scanned(strikes: _Strikes, low: float, high: float, also: Sequence[float]) -> list[float]:
    # Speeds evenly over the decades, in ever smaller strides as long as the effort allows.
    nodes = np.geomspace(low, high, _NODES)
    speeds = sorted({float(nodes[0]), float(nodes[-1]), *(v for v in also if low < v < high)})
    stride = _COARSEST
    while stride >= 1 and strikes.effort < _SCAN_EFFORT:
        speeds = sorted({*speeds, *map(float, nodes[::stride])})
        for speed in speeds:
            strikes.at(speed)
        stride //= 2
    return speeds


def _edge(strikes: _Strikes, low: float, high: float) -> tuple[float, float]:
    # Neighbouring speeds with different ends, between two such.
    below = strikes.at(low)[0]
    while high - low > _EDGE * high and strikes.effort < _EFFORT:
        middle = math.sqrt(low * high) if high > 2.0 * low else 0.5 * (low + high)
        if strikes.at(middle)[0] == below:
            low = middle
        else:
            high = middle
    return low, high


def _turns(strikes: _Strikes, speeds: list[float]) -> list[float]:
    # Where the next strike's speed is largest or smallest between nodes: a narrow range may lie there.
    found: list[float] = []
    for a, b, c in zip(speeds, speeds[1:], speeds[2:], strict=False):
        fa, fb, fc = (strikes.at(v)[1] for v in (a, b, c))
        if not (fb - fa) * (fc - fb) < 0.0:
            continue
        sign, low, high = math.copysign(1.0, fb - fa), a, c
        for _ in range(_TURN_STEPS):
            near, far = low + _GOLDEN * (high - low), high - _GOLDEN * (high - low)
            if strikes.effort > _EFFORT:
                break
            low, high = (low, far) if sign * strikes.at(near)[1] > sign * strikes.at(far)[1] else (near, high)
        found.append(0.5 * (low + high))
    return found


def _preimages(strikes: _Strikes, speeds: list[float], ranges: list[tuple[float, float, int]]) -> list[float]:
    # Speeds whose next strike falls into a range of another end than that of both their neighbours.
    found: list[float] = []
    for a, b in itertools.pairwise(speeds):
        (end, fa), (also, fb) = strikes.at(a), strikes.at(b)
        if end != also or math.isnan(fa) or math.isnan(fb):
            continue
        for start, stop, other in ranges:
            if other == end or not (min(fa, fb) < start and stop < max(fa, fb)):
                continue
            low, high = (a, b) if fa < fb else (b, a)
            for _ in range(_PREIMAGE_STEPS):
                middle = 0.5 * (low + high)
                following = strikes.at(middle)[1]
                if start < following < stop or strikes.effort > _EFFORT:
                    found.append(middle)
                    break
                low, high = (middle, high) if following <= start else (low, middle)
    return found


def _ranges(
    strikes: _Strikes, low: float, high: float, also: Sequence[float]
) -> list[tuple[float, float, int]]:
    # All ranges (from, to, end) between low and high.
    speeds = _scanned(strikes, low, high, also)
    speeds = sorted({*speeds, *_turns(strikes, speeds)})
    ranges: list[tuple[float, float, int]] = []
    for _ in range(_ROUNDS):
        edges = [
            _edge(strikes, a, b)
            for a, b in itertools.pairwise(speeds)
            if strikes.at(a)[0] != strikes.at(b)[0]
        ]
        starts = [low, *(0.5 * (a + b) for a, b in edges)]
        ends = [*(strikes.at(a)[0] for a, _ in edges), strikes.at(high)[0]]
        ranges = list(zip(starts, [*starts[1:], high], ends, strict=True))
        speeds = sorted({*speeds, *(v for edge in edges for v in edge)})
        more = _preimages(strikes, speeds, ranges)
        if all(strikes.at(v)[0] == ranges[bisect(starts, v) - 1][2] for v in more):
            break
        speeds = sorted({*speeds, *more})
    return ranges


def entries(law: Records, scratch: Records, cycle: Cycle) -> list[tuple[float, Numbers]]:
    """Speed of each strike of a roll, m/s, and what is left of earlier pulses then, as a state."""
    found: list[tuple[float, Numbers]] = []
    for state in cycle.states:
        pushes = state.copy()
        return_step.set_state(law[0], scratch[1:], scratch[:1], state)
        measured = np.zeros(return_step.MEASURED_SIZE)
        _, flight_s = return_step.until(
            law[0], scratch[0], exact.ENTRY, return_step.MAX_WAIT_DOUBLINGS, measured
        )
        for name, left in (("pulse", PULSE), ("cor_pulse", COR_PULSE)):
            if name in (law.dtype.names or ()):
                pushes[left] *= math.exp(-flight_s / float(law[name]["tau"][0]))
                pushes[left + return_step.PULSE_AGE - PULSE] += flight_s
        found.append((-float(scratch[0]["v_in"]), pushes))
    return found


def basins(
    law: Records, scratch: Records, cycles: list[Cycle], low_m_per_s: float, high_m_per_s: float
) -> list[Basin]:
    """The ends of all strikes from `low_m_per_s` to `high_m_per_s`, by increasing speed; no earlier pulse still acts.

    law: shape (1,), scratch: shape (2,). cycles: all that are known; rolls of longer period that are met are appended.
    Edges to a relative 1e-10, coarser where the bounded work runs out. Ranges narrower than the scan (4 % of a speed
    when the speeds span four decades) that the return map does not point to are missed.
    """
    strikes = _Strikes(law, scratch, cycles, np.zeros(return_step.STATE_SIZE))
    also = [
        v * factor for cycle in cycles for v, _ in entries(law, scratch, cycle) for factor in (0.999, 1.001)
    ]
    return [
        Basin(start, stop, _ENDS.get(end, "cycle"), cycles[end] if end >= 0 else None)
        for start, stop, end in _ranges(strikes, low_m_per_s, high_m_per_s, also)
    ]


def withstands(
    law: Records, scratch: Records, cycles: list[Cycle], roll: Cycle, known: Sequence[Basin]
) -> Withstands:
    """Limits of one strike, either way, from which the stick still comes back to a stable `roll`.

    known: what `basins` found, which holds for the roll too where its pulses are over by the next strike. The other
    arguments are those of `basins`.
    """
    all_limits: list[Withstands] = []
    for speed, pushes in entries(law, scratch, roll):
        ranges = [(basin.from_m_per_s, basin.to_m_per_s) for basin in known]
        low, high = ranges[0][0], ranges[-1][1]
        remembers = float(np.abs(pushes[[PULSE, COR_PULSE]]).sum()) > _FORGOTTEN * speed
        if remembers or not low <= speed <= high:
            strikes = _Strikes(law, scratch, cycles, pushes)
            low, high = (
                min(low, max(_FARTHEST_LIMIT * speed, SLOWEST_M_PER_S)),
                max(high, speed / _FARTHEST_LIMIT),
            )
            also = [0.999 * speed, speed, 1.001 * speed]
            ranges = [(start, stop) for start, stop, _ in _ranges(strikes, low, high, also)]
        start, stop = next(each for each in ranges if each[0] <= max(speed, low) <= each[1])
        slowest, fastest = (start if start > low else None), (stop if stop < high else None)
        all_limits.append(Withstands(roll, speed, slowest, fastest))
    return min(
        all_limits, key=lambda limits: math.inf if limits.least_m_per_s is None else limits.least_m_per_s
    )
