"""Values along the way from one roll to another: a crescendo at one rate, an accelerando at one level.

    ramp, end = inverse.ramp(inverse.present(law), Leg(), Leg(0.8, seconds=3.0))    # drumstick.analysis.inverse
    ramp.at(1.5)    # {"k_hand": ..., "z_ss": ..., "dv_pls": ...} to be set 1.5 s after it began

The rate goes evenly in Hz, the level in dB. Plain numbers, any thread.
"""

import math
from typing import NamedTuple

import numpy as np

STEP_S = 0.02  # how often the values of a ramp are to be set


class Leg(NamedTuple):
    """Rate Hz or level 0 .. 1 to go to, None: as it is; and in how many seconds."""

    to: float | None = None
    seconds: float = 0.0

    def share(self, at_s: float) -> float:
        """Share of the way, 0 .. 1, this long after its beginning."""
        return min(max(at_s / self.seconds, 0.0), 1.0) if self.seconds > 0.0 else float(at_s >= 0.0)

    def after(self, gone_s: float) -> "Leg":
        """Rest of the way after this time; at its end there is nowhere to go."""
        return Leg(self.to, self.seconds - gone_s) if gone_s < self.seconds else Leg()


class Stand(NamedTuple):
    """A roll on the way: its rate, Hz, and the speed of its strikes, m/s."""

    rate_Hz: float
    speed_m_per_s: float

    def towards(self, end: "Stand", of_rate: float, of_speed: float) -> "Stand":
        """Roll at these shares of the way to `end`."""
        rate_Hz = self.rate_Hz + of_rate * (end.rate_Hz - self.rate_Hz)
        return Stand(rate_Hz, self.speed_m_per_s ** (1.0 - of_speed) * end.speed_m_per_s**of_speed)

    def distance(self, other: "Stand") -> float:
        """Sum of the logarithms of both ratios."""
        return sum(abs(math.log(to / from_)) for from_, to in zip(self, other, strict=True))


class Ramp(NamedTuple):
    """Way between two rolls. values: of the end, by wire name, SI; level: 0 .. 1, there.

    logarithms: those of the sizes of the values at times_s. contact_s: of one contact at the end.
    """

    start: Stand
    end: Stand
    level: float
    rate_leg: Leg
    level_leg: Leg
    values: dict[str, float]
    contact_s: float
    times_s: list[float]
    logarithms: dict[str, list[float]]

    @property
    def seconds(self) -> float:
        """Time after which the values are those of the end."""
        return self.times_s[-1] if self.times_s else 0.0

    @property
    def lead_s(self) -> float:
        """Time until something changes: the stroke that is under way when it begins ends as it was."""
        return 1.0 / self.start.rate_Hz

    def stands_at(self, since_s: float) -> Stand:
        """Roll to which it has come by then."""
        on_way_s = since_s - self.lead_s
        return self.start.towards(self.end, self.rate_leg.share(on_way_s), self.level_leg.share(on_way_s))

    def at(self, since_s: float) -> dict[str, float]:
        """Values to set at this time after the beginning and keep for STEP_S; at last those of the end."""
        if since_s >= self.seconds:
            return self.values
        now_s = since_s + 0.5 * STEP_S
        acts_s = dict.fromkeys(self.values, now_s - 0.5 * self.contact_s)
        acts_s["dv_pls"] = now_s + 0.5 / self.stands_at(now_s).rate_Hz - self.contact_s  # at its beginning
        return {
            name: math.copysign(
                math.exp(float(np.interp(acts_s[name], self.times_s, self.logarithms[name]))), value
            )
            for name, value in self.values.items()
        }
