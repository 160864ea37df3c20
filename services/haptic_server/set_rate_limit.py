"""A source that sends more sets than any hand, fader or automation: a loop of programs that answer each other."""

import enum
from collections.abc import Hashable
from typing import NamedTuple

SETS_A_SECOND = 500.0  # automation in a DAW sends some 200
PATIENCE_S = 2.0
_FORGIVEN_S = 1.0  # after a flood, silence for this long is calm
_MAX_SOURCES = 1024


class Verdict(enum.Enum):
    """Treatment of a set."""

    FREE = enum.auto()
    HELD_FIRST = enum.auto()  # the first one that is held back: its sender is to be told
    HELD = enum.auto()


class _Stretch(NamedTuple):
    # As long as a source sends faster, what it has sent reaches ever further ahead of the clock.
    since_s: float
    calm_at_s: float
    is_held: bool


class SetRateLimit:
    """Holds back sources that were over 500 sets a second for two seconds, until they are calm. One thread only."""

    def __init__(self) -> None:
        self._stretches: dict[Hashable, _Stretch] = {}

    def judge(self, source: Hashable, now_s: float) -> Verdict:
        """Count one set."""
        stretch = self._stretches.pop(source, None)
        if stretch is None or stretch.calm_at_s <= now_s:
            stretch = _Stretch(now_s, now_s, False)
        if len(self._stretches) >= _MAX_SOURCES:
            del self._stretches[next(iter(self._stretches))]  # whoever sent longest ago
        is_held = now_s - stretch.since_s >= PATIENCE_S
        calm_at_s = min(stretch.calm_at_s + 1.0 / SETS_A_SECOND, now_s + _FORGIVEN_S)
        self._stretches[source] = _Stretch(stretch.since_s, calm_at_s, is_held)
        if not is_held:
            return Verdict.FREE
        return Verdict.HELD if stretch.is_held else Verdict.HELD_FIRST
