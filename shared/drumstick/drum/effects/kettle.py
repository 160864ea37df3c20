"""`kettle`: the closed bowl of a timpano, a cylinder as wide as the head, for a bank of modes with air.

Its air is a spring for the circular modes (m = 0), a mass for most others, and has resonances of its own: see
drumstick.drum.modal.air_load. No cost while the drum plays.
"""

from dataclasses import dataclass

from drumstick.parameters.declare import number


@dataclass(frozen=True)
class KettleTable:
    """A closed bowl under the head instead of open air; needs `air` and a bank of modes (`[modal]`)."""

    depth_m: float = number(0.42, 0.05, 2.0, "m", "Depth: volume of the bowl divided by the head's area")


TABLE = KettleTable
NEEDS = ("air", "it is air that it holds")
ON_MODES = True
ON_MESH = False
