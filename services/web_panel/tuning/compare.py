"""Two whole sets of values, A and B, to be heard one after the other. Pure; the main thread's.

`on` is the set that was stored or switched to last; whether it still is what the servo uses is looked at, not
remembered: a value may be set from anywhere.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from drumstick.scenes.table import Z_H0

SLOTS = ("A", "B")


def settable(values: Mapping[str, float]) -> dict[str, float]:
    """Values that a whole set may hold: all but z_h0, which is another view of z_ss."""
    return {name: value for name, value in values.items() if name != Z_H0}


@dataclass
class Compare:
    """The slots that hold something, and which one is on ("" none)."""

    slots: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    on: str = ""

    def store(self, slot: str, values: Mapping[str, float]) -> None:
        """Keep these values in the slot, which is on from now."""
        self.slots[slot] = settable(values)
        self.on = slot

    def switched(self, slot: str) -> None:
        """The slot's values were accepted."""
        self.on = slot

    def changed(self, values: Mapping[str, float]) -> list[str]:
        """Names of the values that are no more what the slot that is on holds."""
        kept = self.slots.get(self.on, {})
        return [name for name, value in settable(values).items() if kept.get(name, value) != value]

    def differing(self) -> list[str]:
        """Names of what A and B differ in."""
        a, b = (self.slots.get(slot, {}) for slot in SLOTS)
        return [name for name in a if name in b and a[name] != b[name]]
