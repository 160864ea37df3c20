"""Values along the way from one roll to another: a crescendo at one rate, an accelerando at one level.

    ramp, end = ramp_to(inverse, inverse.present(law), Leg(), Leg(0.8, seconds=3.0))
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

from drumstick.analysis.inverse import Inverse, Roll, between, moved
from drumstick.scenes.table import Refusal

LONGEST_S = 600.0
STEP_S = 0.02  # how often the values of a ramp are to be set
_NOTHING = 1e-300  # a z_ss of 0 has no logarithm
_NODE = 0.02  # of the logarithms: how far apart the returns that are solved lie


class Leg(NamedTuple):
    """Rate Hz or level 0 .. 1 to go to, None: as it is; and in how many seconds."""

    to: float | None = None
    seconds: float = 0.0

    def share(self, at_s: float) -> float:
        """Share of the way, 0 .. 1, this long after its beginning."""
        return min(max(at_s / self.seconds, 0.0), 1.0) if self.seconds > 0.0 else float(at_s >= 0.0)


class Stand(NamedTuple):
    """A roll on the way: its rate, Hz, and the speed of its strikes, m/s."""

    rate_Hz: float
    speed_m_per_s: float


class Ramp(NamedTuple):
    """Way between two rolls, in plain numbers. values: by wire name, of the end, as `moved` gives them.

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
        return Stand(
            *between(self.start, self.end, self.rate_leg.share(on_way_s), self.level_leg.share(on_way_s))
        )

    def at(self, since_s: float) -> dict[str, float]:
        """Values to set at this time after the beginning and keep for STEP_S; at last those of the end."""
        if since_s >= self.seconds:
            return self.values
        now_s = since_s + 0.5 * STEP_S
        flown_s = now_s - 0.5 * self.contact_s
        fired_s = now_s + 0.5 / self.stands_at(now_s).rate_Hz - self.contact_s
        found: dict[str, float] = {}
        for name, value in self.values.items():
            at_s = fired_s if name == "dv_pls" else flown_s
            size = math.exp(float(np.interp(at_s, self.times_s, self.logarithms[name])))
            found[name] = math.copysign(size, value)
        return found


def ramp_to(inverse: Inverse, start: Roll, rate: Leg, level: Leg) -> tuple[Ramp, Roll]:
    """The ramp, and its end, which is `start` itself where nothing has to change.

    Raises Refusal where the end cannot be met, or something on the way.
    """
    for leg in (rate, level):
        if not 0.0 <= leg.seconds <= LONGEST_S:
            raise Refusal(f"a ramp of {leg.seconds:g} s: send 0 .. {LONGEST_S:g} s")
    end = inverse.towards(start, rate.to, level.to)
    from_, to = (Stand(each.rate_Hz, each.speed_m_per_s) for each in (start, end))
    ramp = Ramp(from_, to, end.level, rate, level, moved(end), end.contact_s, [], {})
    seconds = max(rate.seconds, level.seconds)
    if seconds < STEP_S or end is start:
        return ramp, end
    far = abs(math.log(end.rate_Hz / start.rate_Hz)) + abs(math.log(end.speed_m_per_s / start.speed_m_per_s))
    times_s = ramp.lead_s + np.linspace(0.0, seconds, 2 + math.ceil(far / _NODE))
    for moment in (0.0, rate.seconds, level.seconds):  # returns that begin or end at a bend
        half_s = 0.5 / ramp.stands_at(ramp.lead_s + moment).rate_Hz
        times_s = np.union1d(times_s, ramp.lead_s + moment + np.array([-half_s, half_s]))
    logarithms: dict[str, list[float]] = {name: [] for name in ramp.values}
    near = start
    for time_s in times_s.tolist():
        half_s = 0.5 / ramp.stands_at(time_s).rate_Hz
        before, after = ramp.stands_at(time_s - half_s), ramp.stands_at(time_s + half_s)
        speed = math.sqrt(before.speed_m_per_s * after.speed_m_per_s)
        growth = after.speed_m_per_s / before.speed_m_per_s, after.rate_Hz / before.rate_Hz
        near = inverse.played(near, 0.5 / half_s, speed, *growth)
        for name, value in moved(near).items():
            logarithms[name].append(math.log(max(abs(value), _NOTHING)))
    return ramp._replace(times_s=times_s.tolist(), logarithms=logarithms), end
