"""Verdicts on the quantities of a soak: passed or failed, with the numbers and in words."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drumstick_lab.soak.slope import FEWEST, Floats, Slope, Step, largest_step, slope_of, without

BREATH_KB = 1024.0  # resident memory that an interpreter's pools may take over a run without any leak
WARM_UP = 0.25  # this share of the samples is warm-up: pools fill, pages of code are first touched


@dataclass(frozen=True)
class Verdict:
    """Verdict on one quantity. `passed` is None where a number is reported and not judged."""

    name: str
    unit: str
    passed: bool | None
    words: str
    slope: Slope | None = None  # per hour
    bound: float | None = None  # per hour, or the most that a count may be
    first: float | None = None
    last: float | None = None
    step: Step | None = None

    def as_json(self) -> dict[str, Any]:
        """Plain values; what does not exist is null."""
        fields = asdict(self)
        fields["slope"] = self.slope._asdict() if self.slope else None
        fields["step"] = self.step._asdict() if self.step else None
        return fields


def of_growth(
    name: str, unit: str, hours: Floats, values: Floats, bound_per_h: float, breath: float = 0.0
) -> Verdict:
    """Growth is a slope above `bound_per_h` with all of its interval, in both halves, and not by one single jump.

    What rises by less than `breath` over the whole time is none either.
    """
    warm = round(len(values) * WARM_UP)
    hours, values = np.asarray(hours[warm:], float), np.asarray(values[warm:], float)
    if len(values) < FEWEST:
        words = f"only {len(values)} samples after the warm-up, {FEWEST} are needed: run it longer"
        return Verdict(name, unit, False, words, bound=bound_per_h)
    slope, step = slope_of(hours, values), None
    grows = slope.low > bound_per_h and _in_both_halves(hours, values, bound_per_h)
    if grows:
        found = largest_step(hours, values)
        rest = slope_of(hours, without(hours, values, found))
        if found.by > 0.0 and rest.low <= bound_per_h:
            grows, slope, step = False, rest, found
    risen = slope.per_h * float(hours[-1] - hours[0])
    breathes = grows and risen < breath
    grows = grows and not breathes
    words = _growth_words(unit, grows, slope, bound_per_h, step)
    if breathes:
        words = (
            f"rises by {risen:.3g} {unit} in all, less than the {breath:g} that pools may take: run it longer"
        )
    ends = float(np.median(values[:5])), float(np.median(values[-5:]))
    return Verdict(name, unit, not grows, words, slope, bound_per_h, *ends, step)


def _in_both_halves(hours: Floats, values: Floats, bound_per_h: float) -> bool:
    # A sawtooth that begins low and ends high has a slope, but not in each half.
    middle = len(values) // 2
    if middle < FEWEST:
        return True
    halves = (slice(None, middle), slice(middle, None))
    return all(slope_of(hours[half], values[half]).per_h > bound_per_h for half in halves)


def _told(value: float) -> str:
    # Three digits without an exponent: 2e+03 for 2000 reads as if it were rounded to one.
    return f"{float(f'{value:.3g}'):g}"


def _growth_words(unit: str, grows: bool, slope: Slope, bound: float, step: Step | None) -> str:
    jumped = f"; one jump of {_told(step.by)} {unit} after {step.at_h:.3g} h left out" if step else ""
    if grows:
        return f"grows: at least {_told(slope.low)} {unit}/h, the bound is {_told(bound)}"
    if slope.low > bound:
        return f"rises by {_told(slope.per_h)} {unit}/h over all, but not in each half of the time: no steady growth"
    if slope.high <= bound:
        sign = "rises, but" if slope.low > 0.0 else "falls:" if slope.high < 0.0 else "zero:"
        return f"{sign} the whole interval is under the bound of {_told(bound)} {unit}/h{jumped}"
    if slope.low <= 0.0:
        ends = f"it ends at {_told(slope.high)} {unit}/h, above the bound of {_told(bound)}"
        return f"zero lies in the interval; {ends}{jumped}"
    return f"the interval contains the bound of {_told(bound)} {unit}/h: neither under it nor above it is shown{jumped}"


def of_count(name: str, unit: str, value: float, most: float, words: str) -> Verdict:
    """A count that must not pass `most`; `words` say what it counts."""
    passed = value <= most
    limit = "" if passed else f"; at most {most:g} would do"
    return Verdict(name, unit, passed, f"{words}{limit}", bound=most, last=value)


def unjudged(name: str, unit: str, value: float, words: str) -> Verdict:
    """A number that depends on the machine and what else it does: reported, not judged."""
    return Verdict(name, unit, None, words, last=value)


def all_passed(verdicts: Sequence[Verdict]) -> bool:
    """True when nothing failed."""
    return all(verdict.passed is not False for verdict in verdicts)
