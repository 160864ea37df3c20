"""Values along the way from one roll to another: a crescendo at one rate, an accelerando at one level.

    ramp = ramp_to(inverse, inverse.present(law), Leg(None), Leg(0.8, seconds=3.0))
    ramp.at(1.5)    # {"k_hand": ..., "z_ss": ..., "dv_pls": ...} to be set 1.5 s after it began

The rate goes evenly in Hz, the level in dB. A roll follows its values only after some contacts, and its rate depends on
how hard it has become until then: steady rolls in a row would lag. So each return is solved for what the ramp is
at its end: it starts at one speed and meets the head at the next. k_hand and z_ss act throughout a return and are those
of the one that is half over; dv_pls acts at its beginning.

Any thread; blocks for a fraction of a second.
"""

import math
from typing import NamedTuple

import numpy as np

from drumstick.analysis.cycles.return_step import Numbers
from drumstick.analysis.inverse import Inverse, Roll, between, moved
from drumstick.scenes.table import Refusal

LONGEST_S = 600.0
STEP_S = 0.02  # how often the values of a ramp are to be set
_NODE = 0.02  # of the logarithms: how far apart the returns that are solved lie


class Leg(NamedTuple):
    """Rate Hz or level 0 .. 1 to go to, None: as it is; and in how many seconds."""

    to: float | None
    seconds: float = 0.0

    def share(self, at_s: float) -> float:
        """Share of the way, 0 .. 1, this long after its beginning."""
        return min(max(at_s / self.seconds, 0.0), 1.0) if self.seconds > 0.0 else float(at_s >= 0.0)


class Ramp(NamedTuple):
    """Way between two rolls. sizes: the logarithms of what `moved` gives, shape (3, n), at times_s."""

    start: Roll
    end: Roll
    rate: Leg
    level: Leg
    times_s: Numbers
    sizes: Numbers

    @property
    def seconds(self) -> float:
        """Time after which the values are those of the end."""
        return float(self.times_s[-1])

    @property
    def lead_s(self) -> float:
        """Time until something changes: the stroke that is under way when it begins ends as it was."""
        return 1.0 / self.start.rate_Hz

    def stands_at(self, since_s: float) -> tuple[float, float]:
        """Rate Hz and speed m/s to which it has come by then."""
        shares = self.rate.share(since_s - self.lead_s), self.level.share(since_s - self.lead_s)
        return between(self.start, self.end.rate_Hz, self.end.speed_m_per_s, *shares)

    def at(self, since_s: float) -> dict[str, float]:
        """Values to set at this time after the beginning and keep for STEP_S; at last those of the end."""
        values = moved(self.end)
        if since_s >= self.seconds:
            return values
        now_s, contact_s = since_s + 0.5 * STEP_S, self.end.contact_s
        fired_s = now_s + 0.5 / self.stands_at(now_s)[0] - contact_s
        for name, logarithms, at_s in zip(
            values, self.sizes, (now_s - 0.5 * contact_s, now_s - 0.5 * contact_s, fired_s), strict=True
        ):
            values[name] = math.copysign(
                math.exp(float(np.interp(at_s, self.times_s, logarithms))), values[name]
            )
        return values


def ramp_to(inverse: Inverse, start: Roll, rate: Leg, level: Leg) -> Ramp:
    """The ramp; raises Refusal where its end cannot be met, or something on the way. `end` may be `start` itself."""
    for leg in (rate, level):
        if not 0.0 <= leg.seconds <= LONGEST_S:
            raise Refusal(f"a ramp of {leg.seconds:g} s: send 0 .. {LONGEST_S:g} s")
    end = inverse.towards(start, rate.to, level.to)
    ramp = Ramp(start, end, rate, level, np.zeros(1), np.zeros((3, 1)))
    seconds = max(rate.seconds, level.seconds)
    if seconds < STEP_S or end is start:
        return ramp
    far = abs(math.log(end.rate_Hz / start.rate_Hz)) + abs(math.log(end.speed_m_per_s / start.speed_m_per_s))
    times_s = ramp.lead_s + np.linspace(0.0, seconds, 2 + math.ceil(far / _NODE))
    for moment in (0.0, rate.seconds, level.seconds):  # returns that begin or end at a bend
        half_s = 0.5 / ramp.stands_at(ramp.lead_s + moment)[0]
        times_s = np.union1d(times_s, ramp.lead_s + moment + np.array([-half_s, half_s]))
    sizes, near = np.zeros((3, len(times_s))), start
    for at, time_s in enumerate(times_s):
        half_s = 0.5 / ramp.stands_at(time_s)[0]
        (slow, soft), (fast, loud) = ramp.stands_at(time_s - half_s), ramp.stands_at(time_s + half_s)
        near = inverse.played(near, 0.5 / half_s, math.sqrt(soft * loud), loud / soft, fast / slow)
        sizes[:, at] = np.log(np.abs(list(moved(near).values())))
    return ramp._replace(times_s=times_s, sizes=sizes)
