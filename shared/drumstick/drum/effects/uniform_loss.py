"""`uniform_loss`: the same share from all modes. It is in the coefficients of mesh and modes, and costs nothing."""

from dataclasses import dataclass

from drumstick.parameters.declare import number


@dataclass(frozen=True)
class UniformLossTable:
    """All modes lose the same share, besides the drum's own decay. Costs nothing: it is in the coefficients."""

    t60_s: float = number(3.0, 0.02, 60.0, "s", "Time in which this loss alone would take 60 dB")


TABLE = UniformLossTable
FORMER_NAME = "air_loss"
ON_MODES = True


def even_loss_per_s(table: UniformLossTable) -> float:
    """1/t60 of this loss alone."""
    return 1.0 / table.t60_s
