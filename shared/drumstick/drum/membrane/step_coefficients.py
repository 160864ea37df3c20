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

    def gains(self) -> dict[str, float]:
        """Gains of u and u- in a step; in the fourth order of A A u, and of A u less that."""
        scheme, divisor = self.scheme, self.loss_divisor
        return {
            "u_gain": (2.0 if scheme.order_4 else 2.0 - scheme.tau) / divisor,
            "u_old_gain": (1.0 - self.losses.s) / divisor,
            "order_4": scheme.order_4 / divisor,
            "order_2": (scheme.tau - scheme.order_4) / divisor if scheme.order_4 else 0.0,
        }
