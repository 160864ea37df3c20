"""Time on the haptic machine: its monotonic clock against ours, from round trips of the `clock` query.

The answer was given somewhere within the round trip, so each trip bounds the offset between the two clocks by what no
delay can undo, however uneven the two ways are; a short trip bounds it tightly. The trips of the last two minutes are
kept: where several short ones agree that one clock gains on the other, that drift is taken out as well. The wall clocks
of the two machines do not matter.
"""

import math
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

from protocol.messages import Clock, decode

_ROUND_TRIPS = 5
_SHORTEST_PAUSE_S, _MAX_PAUSE_S = 0.5, 10.0
_KEPT_NS = 120_000_000_000
# Quartz is off by less, two of them together.
_MAX_DRIFT = 300e-6
# How far the drift may be from what was estimated: temperature, and the estimate's own error beyond its bounds.
_WANDER = 5e-6


@dataclass(frozen=True)
class RoundTrip:
    """One `clock` query: our time before and after, the answer's boot and time; all ns."""

    sent_ns: int
    received_ns: int
    boot: int
    answer_ns: int

    @property
    def middle_ns(self) -> int:
        """Our time halfway."""
        return (self.sent_ns + self.received_ns) // 2

    @property
    def offset_ns(self) -> int:
        """Haptic minus ours, if both ways took equally long."""
        return self.answer_ns - self.middle_ns

    @property
    def error_ns(self) -> float:
        """The offset is wrong by at most this."""
        return (self.received_ns - self.sent_ns) / 2 + 1.0  # the middle is a whole number


@dataclass(frozen=True)
class HapticClock:
    """Valid for one boot of the servo: another may mean another machine, or the same one restarted.

    `offset_ns` is haptic minus ours at our time `at_ns`, wrong by at most `error_ns` there; `drift` is how much faster
    the haptic clock runs than ours (1e-6: a microsecond in a second).
    """

    boot: int
    offset_ns: int
    error_ns: int
    drift: float = 0.0
    at_ns: int = 0

    def ours(self, haptic_ns: int) -> int:
        """Our monotonic time of an instant of the haptic machine's."""
        if self.drift == 0.0:
            return haptic_ns - self.offset_ns
        since_ns = (haptic_ns - self.offset_ns - self.at_ns) / (1.0 + self.drift)
        return self.at_ns + round(since_ns)

    def haptic(self, our_ns: int) -> int:
        """The haptic machine's monotonic time of an instant of ours."""
        return our_ns + self.offset_ns + round(self.drift * (our_ns - self.at_ns))


class ClockMap:
    """Gathers round trips to one haptic machine. One thread at a time."""

    def __init__(self) -> None:
        self._trips: deque[RoundTrip] = deque()

    def add(self, trips: Iterable[RoundTrip]) -> None:
        """Take newer trips, in order. Those of an earlier boot are forgotten, and so are old ones."""
        for trip in trips:
            if self._trips and self._trips[-1].boot != trip.boot:
                self._trips.clear()
            self._trips.append(trip)
        while self._trips and self._trips[-1].received_ns - self._trips[0].received_ns > _KEPT_NS:
            self._trips.popleft()

    @property
    def pause_s(self) -> float:
        """Pause before the next comparison: short at first, while a drift is not known, then ten seconds."""
        if not self._trips:
            return _SHORTEST_PAUSE_S
        compared_s = (self._trips[-1].received_ns - self._trips[0].sent_ns) * 1e-9
        return min(max(compared_s, _SHORTEST_PAUSE_S), _MAX_PAUSE_S)

    def clock(self) -> HapticClock | None:
        """The best that the trips say, as of the newest; None without any."""
        if not self._trips:
            return None
        at_ns = self._trips[-1].middle_ns
        bounds = [_Bound.of(trip, at_ns) for trip in self._trips]
        low, high = _drift_bounds(bounds)
        if low > high:
            # No drift explains them all: one of the clocks stood still or jumped, a machine was suspended.
            self._trips = deque([self._trips[-1]])
            bounds, low, high = bounds[-1:], -_MAX_DRIFT, _MAX_DRIFT
        least = -_highest(lambda drift: min(b.error - b.offset + drift * b.age for b in bounds), low, high)
        most = _highest(lambda drift: min(b.offset + b.error - drift * b.age for b in bounds), low, high)
        offset_ns, error_ns = round((least + most) / 2), math.ceil((most - least) / 2) + 1
        if all(abs(trip.offset_ns) <= trip.error_ns for trip in self._trips):
            # One clock: those of two machines count from their own starts. Long trips, on a machine that is busy, would
            # be explained by a drift that is not there, ms before the next comparison.
            return HapticClock(self._trips[-1].boot, 0, error_ns + abs(offset_ns), 0.0, at_ns)
        return HapticClock(self._trips[-1].boot, offset_ns, error_ns, _likely_drift(bounds, low, high), at_ns)


class _Bound(NamedTuple):
    # A trip seen from a later time, ns: at `age` (negative) the offset was `offset`, wrong by `error` at most.
    age: float
    offset: float
    error: float

    @classmethod
    def of(cls, trip: RoundTrip, at_ns: int) -> "_Bound":
        age = trip.middle_ns - at_ns
        return cls(age, trip.offset_ns, trip.error_ns + _WANDER * -age)


def _drift_bounds(bounds: list[_Bound]) -> tuple[float, float]:
    # Each pair of trips bounds the drift; some sixty trips are kept.
    low, high = -_MAX_DRIFT, _MAX_DRIFT
    for i, one in enumerate(bounds):
        for other in bounds[i + 1 :]:
            span = other.age - one.age
            if span > 0.0:
                gained, error = other.offset - one.offset, other.error + one.error
                low, high = max(low, (gained - error) / span), min(high, (gained + error) / span)
    return low, high


def _highest(value: Callable[[float], float], low: float, high: float) -> float:
    # The largest value of a concave function of the drift: straight lines, of which the lowest counts.
    for _ in range(60):
        third = (high - low) / 3.0
        if value(low + third) < value(high - third):
            low += third
        else:
            high -= third
    return value((low + high) / 2.0)


def _likely_drift(bounds: list[_Bound], low: float, high: float) -> float:
    # The straight line through the offsets, each weighing by its own bound, kept within what is certain. With nothing
    # certain it is 0: two clocks that nobody compared for long are best taken for equal.
    if high - low >= 2.0 * _MAX_DRIFT:
        return 0.0
    weights = [1.0 / bound.error**2 for bound in bounds]
    total = sum(weights)
    centre = sum(w * b.age for w, b in zip(weights, bounds, strict=True)) / total
    middle = sum(w * b.offset for w, b in zip(weights, bounds, strict=True)) / total
    spread = sum(w * (b.age - centre) ** 2 for w, b in zip(weights, bounds, strict=True))
    if spread == 0.0:
        return 0.0
    leaning = sum(w * (b.age - centre) * (b.offset - middle) for w, b in zip(weights, bounds, strict=True))
    return min(max(leaning / spread, low), high)


def asked_clock(
    known: ClockMap, ask: Callable[[], bytes | None], warn: Callable[[str], None]
) -> HapticClock | None:
    """Five more round trips for `known`, and what it says then. Blocks as long as `ask` does, five times at most.

    `ask` returns the payload of one answer to the `clock` query, or None; `warn` is called with words about one that
    is nonsense. None when nobody answers: what was known may be of another machine.
    """
    trips: list[RoundTrip] = []
    for _ in range(_ROUND_TRIPS):
        sent = time.monotonic_ns()
        payload = ask()
        received = time.monotonic_ns()
        if payload is None:
            break
        try:
            answer = decode(payload, Clock)
        except ValueError as error:
            warn(f"clock ignored: {error}")
            break
        trips.append(RoundTrip(sent, received, answer.boot, answer.t_ns))
    known.add(trips)
    return known.clock() if trips else None
