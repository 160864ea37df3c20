"""Ends of a scene: every roll or rest that a strike can lead to, where they part, and what breaks a roll.

Any thread; blocks for some tenths of a second.
"""

from dataclasses import dataclass

from drumstick.analysis.cycles.basins import SLOWEST_M_PER_S, Basin, Withstands, basins, entries, withstands
from drumstick.analysis.cycles.cycle import Cycle
from drumstick.analysis.rebound import capture_speed
from drumstick.parameters.scene import Scene
from realtime.records import Records

_BELOW_ALL_CHANGES = 1e-2  # of the slowest speed at which anything is known to change


@dataclass(frozen=True)
class Ends:
    """basins: by increasing strike speed, without gaps. withstands: one entry for each stable roll."""

    basins: tuple[Basin, ...]
    withstands: tuple[Withstands, ...]

    @property
    def count(self) -> int:
        """Number of stable ends: rolls, rest in the head, leaving, and going on without a period."""
        rolls = [limits.cycle for limits in self.withstands]
        return len(rolls) + len({basin.end for basin in self.basins if basin.cycle is None})

    def limits_of(self, cycle: Cycle) -> Withstands | None:
        """Limits of one strike of this roll; None for an unstable one."""
        return next((limits for limits in self.withstands if limits.cycle is cycle), None)


def ends_of(scene: Scene, law: Records, scratch: Records, cycles: list[Cycle]) -> Ends:
    """The ends of strikes up to the guard's `max_speed_m_per_s`, or twice the fastest roll's own.

    law: shape (1,), of the values in use; scratch: shape (2,). cycles: those of `fixed_points`; rolls of longer period
    that a strike leads to are appended.
    """
    own = [speed for cycle in cycles for speed, _ in entries(law, scratch, cycle)]
    high = max(scene.guard.max_speed_m_per_s, 2.0 * max(own, default=0.0))
    known = [*own, scene.hand.throw_m_per_s, capture_speed(scene) or high]
    low = _BELOW_ALL_CHANGES * min(speed for speed in known if speed > SLOWEST_M_PER_S)
    ranges = basins(law, scratch, cycles, low, high)
    stable = [cycle for cycle in cycles if cycle.stable]
    return Ends(tuple(ranges), tuple(withstands(law, scratch, cycles, roll, ranges) for roll in stable))
