"""Undo and redo of changes, step by step. Pure; the main thread's.

A drag is accepted many times a second and is one step: a change of the same value that follows within a second belongs
to the step before it, if it sets out from a value that this step has held. What somebody else set in between is a start
of its own: undo leads back to it and not past it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

MAX_STEPS = 100
_SAME_GESTURE_S = 1.0


@dataclass
class Step:
    """Values before and after one change, SI units, by wire name: the same names in both."""

    before: dict[str, float]
    after: dict[str, float]


@dataclass
class UndoHistory:
    """Steps that were accepted, the newest last, and those taken back since. Times are seconds of one clock."""

    back: list[Step] = field(default_factory=list[Step])
    forth: list[Step] = field(default_factory=list[Step])
    _noted_at: float = float("-inf")
    _passed: set[tuple[float, ...]] = field(default_factory=set[tuple[float, ...]])  # by the newest step

    def note(
        self, before: Mapping[str, float], after: Mapping[str, float], now: float, dragged: bool = False
    ) -> None:
        """A change was accepted; one that changes nothing is none. dragged: several values by one slider."""
        names = [name for name in after if name in before]
        last = self.back[-1] if self.back else None
        goes_on = (
            (dragged or len(names) == 1)
            and last is not None
            and last.after.keys() == set(names)
            and now - self._noted_at < _SAME_GESTURE_S
            # Not `last.after` alone: a drag asks for the next value before the one under way was answered.
            and tuple(before[name] for name in names) in self._passed
        )
        self._noted_at = now
        if last is not None and goes_on:
            last.after = {name: after[name] for name in names}
            self._passed.add(tuple(last.after.values()))
            if last.after == last.before:
                self.back.pop()
                self._noted_at = float("-inf")  # what follows is no part of the step before this one
            return
        if any(before[name] != after[name] for name in names):
            step = Step({name: before[name] for name in names}, {name: after[name] for name in names})
            self.back = [*self.back[-MAX_STEPS + 1 :], step]
            self._passed = {tuple(step.before.values()), tuple(step.after.values())}
            self.forth.clear()

    def undone(self, values: Mapping[str, float]) -> None:
        """These values, of a step back, were accepted: it can be done again now. Others may have been noted since."""
        self._noted_at = float("-inf")
        for place in reversed(range(len(self.back))):
            if self.back[place].before == values:
                self.forth.append(self.back.pop(place))
                return

    def redone(self, values: Mapping[str, float]) -> bool:
        """These values, of the step undone last, were accepted; False where another change has cleared it since."""
        self._noted_at = float("-inf")
        if not (self.forth and self.forth[-1].after == values):
            return False
        self.back.append(self.forth.pop())
        return True
