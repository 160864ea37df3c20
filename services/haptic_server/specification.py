"""Limits of a device, which its guard may tighten and never raise. Any thread."""

import math
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Specification:
    """Numbers of one model of device. inf: no limit of its own.

    workspace_m: extent along the paper's x, y, z. stiffness_N_per_m and damping_N_s_per_m: the most that it can render.
    rates_Hz: rising; a driver may refuse one of them all the same. moving_kg: from .. to, what the motors move at the
    tip, over the workspace and with what a hand adds to it. grip_N_per_m: the firmest grip of a hand.

    >>> import drumstick as ds
    >>> arm = ds.Specification("my arm", (0.4, 0.2, 0.25), 3e-5, 8.5, 1.4, 3500.0, 20.0, range(500, 2001))
    >>> arm.rate_words
    '500 .. 2000'
    """

    name: str
    workspace_m: tuple[float, float, float]
    resolution_m: float
    max_force_N: float
    continuous_force_N: float
    stiffness_N_per_m: float
    damping_N_s_per_m: float
    rates_Hz: Sequence[int]
    moving_kg: tuple[float, float] = (0.064, 0.15)
    grip_N_per_m: float = 500.0

    @property
    def rate_words(self) -> str:
        """The rates for a reader: `500 .. 4000`, or one by one."""
        rates = self.rates_Hz
        if isinstance(rates, range) and rates.step == 1:
            return f"{rates.start} .. {rates.stop - 1}"
        return ", ".join(str(rate) for rate in rates)


_ANY_RATE = range(500, 4001)  # our own loop paces them
# The paper's stick itself has no motors; its scene's envelope bounds it.
EXACT_STICK = Specification(
    "exact stick", (1.0, 1.0, 1.0), 0.0, math.inf, math.inf, math.inf, math.inf, _ANY_RATE
)
# Second-hand figures; the vendor's table was not at hand. The paper's z is the device's height. A hand that holds a
# stylus is some hundred N/m, and adds some ten grams to the 75 of the arm.
PREMIUM_1_5 = Specification(
    "simulated PHANTOM Premium 1.5", (0.381, 0.191, 0.267), 3e-5, 8.5, 1.4, 3500.0, math.inf, _ANY_RATE
)
