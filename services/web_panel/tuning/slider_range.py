"""Range of a slider, and the values of its positions. Pure.

The table's ranges are what physics allows (K_coll 1 .. 1e6 N/m); a slider over all of that would tune nothing. It
travels around the scene's own value instead, and further when the servo uses a value outside.
"""

import math
from dataclasses import dataclass

from drumstick.parameters.declare import Quantity
from web_panel.page.wording import figure

_DECADES_EACH_WAY = 1.0
_TIMES = 5.0
_STEPS = 200
_NOTHING = 1e-9  # a smaller share of the table's range is 0: no slider can show it
_LOG_STEP = 0.01


@dataclass(frozen=True)
class SliderRange:
    """Values low .. high; positions are the values themselves, or their decimal logarithm."""

    low: float
    high: float
    log: bool

    @property
    def low_position(self) -> float:
        """The slider's left end."""
        return self.position(self.low)

    @property
    def high_position(self) -> float:
        """The slider's right end."""
        return self.position(self.high)

    @property
    def step(self) -> float:
        """Smallest move, as a position: 1/200 of the way or finer, 2.3 % on a logarithmic slider."""
        return _LOG_STEP if self.log else _round_down((self.high - self.low) / _STEPS)

    def position(self, value: float) -> float:
        """Position of `value`, kept within the travel."""
        value = min(max(value, self.low), self.high)
        return math.log10(value) if self.log else value

    def value(self, position: float) -> float:
        """The value at a position, rounded to three figures on a logarithmic slider, within the travel."""
        value = float(f"{10.0**position:.3g}") if self.log else float(f"{position:.6g}")
        return min(max(value, self.low), self.high)

    def marks(self) -> tuple[tuple[float, str], ...]:
        """Positions with their labels: five along a linear slider, 1-2-5 along a logarithmic one."""
        if not self.log:
            values = [self.low + (self.high - self.low) * i / 4 for i in range(5)]
            return tuple((value, _short(value)) for value in values)
        first, last = math.floor(self.low_position), math.ceil(self.high_position)
        values = [m * 10.0**e for e in range(first, last + 1) for m in (1, 2, 5)]
        inside = [v for v in values if self.low * 0.999 <= v <= self.high * 1.001]
        if len(inside) > 8:
            inside = [v for v in inside if math.log10(v) % 1.0 < 0.01 or math.log10(v) % 1.0 > 0.99]
        return tuple((self.position(v), _short(v)) for v in inside)

    def closed(self, low: float, high: float) -> tuple[float, float]:
        """Shares of the travel, from its left and from its right end, outside the values low .. high."""
        whole = self.high_position - self.low_position
        return (
            (self.position(low) - self.low_position) / whole,
            (self.high_position - self.position(high)) / whole,
        )

    def including(self, value: float, quantity: Quantity) -> "SliderRange":
        """This travel, stretched so that `value` has room; never beyond the table's range."""
        if self.low <= value <= self.high or not math.isfinite(value):
            return self
        other = range_around(quantity, value)
        return SliderRange(min(self.low, other.low), max(self.high, other.high), self.log)


def _short(value: float) -> str:
    # Marks stand close on a phone.
    return f"{figure(value / 1000.0)}k" if abs(value) >= 1000.0 else figure(value)


def range_around(quantity: Quantity, value: float) -> SliderRange:
    """SliderRange for a parameter whose scene says `value`; a value that is not finite counts as 0."""
    low, high = quantity.low, quantity.high
    value = value if math.isfinite(value) else 0.0
    if (low, high) == (0.0, 1.0):  # a share: its ends are what one reaches for
        return SliderRange(low, high, False)
    if quantity.scale == "log" and low > 0.0:
        value = min(max(value, low), high)
        factor = 10.0**_DECADES_EACH_WAY
        return SliderRange(max(low, value / factor), min(high, value * factor), True)
    counts = abs(value) > _NOTHING * (high - low)
    reach = _round_up(_TIMES * abs(value)) if counts else (high - low) / 20.0
    return SliderRange(max(low, -reach if low < 0.0 else 0.0), min(high, reach), False)


def _round_up(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{m * power:.3g}") for m in (1, 2, 5, 10) if m * power >= value * 0.999999)


def _round_down(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{m * power:.3g}") for m in (5, 2, 1) if m * power <= value * 1.000001)
