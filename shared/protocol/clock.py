"""When it is on the haptic machine: its monotonic clock against ours, from round trips of the `clock` query.

The middle of a round trip is wrong by at most half of it, so the shortest of a few counts.
"""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from protocol.messages import Clock, decode

_ROUND_TRIPS = 5


@dataclass(frozen=True)
class RoundTrip:
    """One `clock` query: our time before and after, the answer's boot and time; all ns."""

    sent_ns: int
    received_ns: int
    boot: int
    answer_ns: int


@dataclass(frozen=True)
class HapticClock:
    """Valid for one boot of the servo: another may mean another machine, or the same one restarted."""

    boot: int
    offset_ns: int  # haptic minus ours
    error_ns: int

    def ours(self, haptic_ns: int) -> int:
        """Our monotonic time of an instant of the haptic machine's."""
        return haptic_ns - self.offset_ns

    def haptic(self, our_ns: int) -> int:
        """The haptic machine's monotonic time of an instant of ours."""
        return our_ns + self.offset_ns


def clock_from(trips: Iterable[RoundTrip]) -> HapticClock | None:
    """The clock by the shortest round trip of the newest boot; None without any."""
    found = list(trips)
    if not found:
        return None
    boot = found[-1].boot
    best = min((t for t in found if t.boot == boot), key=lambda t: t.received_ns - t.sent_ns)
    middle = (best.sent_ns + best.received_ns) // 2
    return HapticClock(boot, best.answer_ns - middle, (best.received_ns - best.sent_ns) // 2)


def asked_clock(ask: Callable[[], bytes | None], complain: Callable[[str], None]) -> HapticClock | None:
    """The clock from five round trips; None when nobody answers. Blocks as long as `ask` does, five times at most.

    `ask` returns the payload of one answer to the `clock` query, or None; `complain` hears of one that is nonsense.
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
            complain(f"clock ignored: {error}")
            break
        trips.append(RoundTrip(sent, received, answer.boot, answer.t_ns))
    return clock_from(trips)
