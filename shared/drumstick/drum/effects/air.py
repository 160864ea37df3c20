"""`air`: what a head carries along on both sides, and what it radiates, mode by mode, for a bank of modes.

It is in the modes' pitches, decays and shapes (drumstick.drum.modal.air_load), and costs nothing while it plays. A mesh
has no such thing yet: the air's mass falls with the wavelength, which no mass of a junction does.
"""

from dataclasses import dataclass

from drumstick.parameters.declare import number


@dataclass(frozen=True)
class AirTable:
    """The air around the head, which stands in a wall: f01_Hz is what sounds with it."""

    density_kg_per_m3: float = number(1.2, 0.0, 10.0, "kg/m^3", "Density; 0 is no air")
    head_kg_per_m2: float = number(0.26, 0.05, 2.0, "kg/m^2", "Mass per area of the head alone")


TABLE = AirTable
ON_MODES = True
ON_MESH = False
