"""`[strike]`: from the stick's speed to the level of a strike, and to the stroke that this level stands for."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from drumstick.parameters.declare import choice, number, numbers

MAX_POINTS = 16  # rows that a key of a scene may have
SOFTEST_M_PER_S = 0.05


@dataclass(frozen=True)
class Strike:
    """Conversion of strikes to numbers for instruments, and to strokes of a mallet."""

    curve: Literal["linear", "log", "table"] = choice(
        "linear",
        ("linear", "log", "table"),
        "How the level follows the stick's speed: in proportion (linear), in decibels (log), by points (table)",
    )
    full_scale_m_per_s: float = number(
        2.0, 0.01, 20.0, "m/s", "Speed of a strike whose level is 1; of a table, its last speed"
    )
    softest_m_per_s: float = number(
        SOFTEST_M_PER_S, 0.001, 10.0, "m/s", "log: speed up to which the level is 0"
    )
    table: tuple[tuple[float, ...], ...] = numbers(
        (), 2, 0.0, 20.0, "m/s; level 0 .. 1", "table: its points, each [speed, level], straight between them"
    )
    stroke_m_per_s: float = number(
        0.0,
        0.0,
        20.0,
        "m/s",
        "Mallet's speed for the hardest stroke (level 1); 0: the mallet is always as fast as the stick",
    )
    soft_stroke_m_per_s: float = number(
        0.0,
        0.0,
        20.0,
        "m/s",
        "Mallet's speed for the softest stroke (level 0); used only with stroke_m_per_s, and below it",
    )

    def speed_at(self, level: float) -> float:
        """The lowest speed of the stick, m/s, at which a strike has this level, 0 .. 1: the curve backwards."""
        if self.curve == "linear":
            return level * self.full_scale_m_per_s
        if self.curve == "log":
            return self.softest_m_per_s * (self.full_scale_m_per_s / self.softest_m_per_s) ** level
        for (slower, softer), (faster, harder) in pairwise(self.table):
            if softer < level <= harder:
                return slower + (faster - slower) * (level - softer) / (harder - softer)
        return self.table[0 if level <= self.table[0][1] else -1][0]

    def stroke_at(self, level: float, speed_m_per_s: float) -> float:
        """Speed of the stroke, m/s, for which a strike of this level at this speed of the stick stands."""
        if self.stroke_m_per_s == 0.0:
            return speed_m_per_s
        share = min(max(level, 0.0), 1.0)
        return self.soft_stroke_m_per_s + share * (self.stroke_m_per_s - self.soft_stroke_m_per_s)
