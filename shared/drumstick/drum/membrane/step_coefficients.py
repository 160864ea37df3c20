"""Numbers of one step of a head, as its kernels and those beside them need them. Any thread."""

from dataclasses import dataclass

from drumstick.drum.membrane.scheme import Losses, Scheme


@dataclass(frozen=True)
class StepCoefficients:
    """spring: K T^2 of what holds the whole head; scheme: as far as losses, spring and tension leave it."""

    losses: Losses
    spring: float
    scheme: Scheme

    @property
    def with_momentum(self) -> bool:
        """True where high modes lose more, so that the junctions' momentum is kept."""
        return self.losses.eta > 0.0

    @property
    def loss_divisor(self) -> float:
        """1 + s; 1 with momentum."""
        return 1.0 if self.with_momentum else 1.0 + self.losses.s

    @property
    def weight_scale(self) -> float:
        """Factor of the weights."""
        return 1.0 if self.scheme.order_4 else self.scheme.tau / self.loss_divisor
