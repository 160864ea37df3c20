"""`air_loss`: the air takes from all modes alike. It is in the coefficients of mesh and modes, and costs nothing."""

from dataclasses import dataclass

from drumstick.parameters.declare import number


@dataclass(frozen=True)
class AirLossTable:
    """The air takes from all modes alike, besides the drum's own decay. Costs nothing: it is in the coefficients."""

    t60_s: float = number(3.0, 0.02, 60.0, "s", "Time in which the air alone would take 60 dB")


TABLE = AirLossTable
ON_MODES = True
