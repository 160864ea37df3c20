"""Messages between the gateway and the process that finds rolls."""

import msgspec

from drumstick.analysis.ramp import Leg, Ramp, Stand


class FindRamp(msgspec.Struct, frozen=True, tag="ramp"):
    """A roll to find: its rate and level, values that were accepted last (wire names, SI).

    under_way: where a ramp from the roll that was found last has come to, and these values with it. Answered by a Ramp,
    whose end is where it begins when nothing has to change.
    """

    values: dict[str, float]
    rate: Leg
    level: Leg
    under_way: Stand | None = None


class Predict(msgspec.Struct, frozen=True, tag="predict"):
    """Values in use (wire names, SI). Answered by Predicted."""

    values: dict[str, float]


class Predicted(msgspec.Struct, frozen=True, tag="predicted"):
    """Roll that the values lead to; 0, 0: none."""

    rate_Hz: float = 0.0
    level: float = 0.0


class Refused(msgspec.Struct, frozen=True, tag="refused"):
    """Reason, in words."""

    why: str


Question = FindRamp | Predict
Answer = Ramp | Predicted | Refused
