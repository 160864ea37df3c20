"""`kettle`: the closed bowl of a timpano, a cylinder as wide as the head, for a bank of modes with air.

The air in it is a stiffness for the round modes and a mass for most others, with resonances of its own: see
drumstick.drum.modal.air_load. It costs nothing while it plays.
"""

from dataclasses import dataclass

from drumstick.parameters.declare import number


@dataclass(frozen=True)
class KettleTable:
    """A closed bowl under the head instead of open air."""

    depth_m: float = number(0.42, 0.05, 2.0, "m", "Depth of a cylinder of the bowl's volume")


TABLE = KettleTable
ON_MODES = True
ON_MESH = False
