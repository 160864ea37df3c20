"""The recording's one time line: wall-clock ns, counted on from its start by this machine's monotonic clock.

A wall clock that is set while it records does not tear the recording. Not locked: the writing thread's only.
"""

import time
from dataclasses import dataclass

from protocol.clock import HapticClock

_IMPLAUSIBLE_NS = 1_000_000_000
OLDEST_NS = 3600 * 1_000_000_000  # that an event can have been under way: a strike may wait for a gateway


def wall_minus_monotonic_ns() -> int:
    """The wall clock (ns since 1970) against the monotonic clock, now, to a microsecond or so."""
    before = time.monotonic_ns()
    wall = time.time_ns()
    after = time.monotonic_ns()
    return wall - (before + after) // 2


@dataclass
class TimeLine:
    """`offset_ns`: wall minus monotonic at the start."""

    offset_ns: int
    clock: HapticClock | None = None

    def wall_ns(self, monotonic_ns: int) -> int:
        """Wall-clock ns of an instant of this machine's monotonic clock."""
        return monotonic_ns + self.offset_ns

    def learn(self, clock: HapticClock) -> bool:
        """Take a newly measured clock, if it says something new; whether it did.

        One that agrees with the one in use within their errors does not replace it: each would move the times of a
        steady roll by its own error.
        """
        known = self.clock
        if known is not None and known.boot == clock.boot:
            apart = abs(clock.offset_ns - (known.haptic(clock.at_ns) - clock.at_ns))
            if apart <= clock.error_ns + known.error_ns and clock.error_ns >= known.error_ns // 4:
                return False
        self.clock = clock
        return True

    def event_ns(self, t_ns: int | None, boot: int | None, heard_ns: int) -> int:
        """Wall-clock ns of an event at `t_ns` of the haptic machine, heard at `heard_ns` of our monotonic clock.

        Of an event without a time, or of a boot whose clock is not known, it is when it was heard; so it is for one
        that would be heard more than a second before it happened or more than an hour after, and for a message without
        a boot whose time is more than a second from then (its sender had no clock).
        """
        clock = self.clock
        if t_ns is None or clock is None or (boot is not None and boot != clock.boot):
            return self.wall_ns(heard_ns)
        ours = clock.ours(t_ns)
        oldest_ns = _IMPLAUSIBLE_NS if boot is None else OLDEST_NS
        if ours - heard_ns > _IMPLAUSIBLE_NS or heard_ns - ours > oldest_ns:
            return self.wall_ns(heard_ns)
        return max(self.wall_ns(ours), 0)
