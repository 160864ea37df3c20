"""`[strike]` as it may be written: its curve, and what only several values together can get wrong."""

from itertools import pairwise
from typing import Any

from drumstick.parameters.drum import Drum
from drumstick.parameters.strike import MAX_POINTS, SOFTEST_M_PER_S, Strike
from drumstick.scenes.reading import Reader


def strike_of(reader: Reader, given: object) -> Strike:
    """The table `[strike]`; a curve by points has its full scale at the last of them."""
    values: dict[str, Any] = reader.values("strike", Strike, given)
    points: tuple[tuple[float, ...], ...] = values.get("table", ())
    if values.get("curve") == "table" and _are_a_curve(reader, points):
        last = points[-1][0]
        given_m_per_s = values.setdefault("full_scale_m_per_s", last)
        if given_m_per_s != last:
            reader.refuse(
                "strike.full_scale_m_per_s",
                f"{given_m_per_s:g} m/s is not the last speed of strike.table, {last:g} m/s: leave it out",
            )
    return Strike(**values)


def _are_a_curve(reader: Reader, points: tuple[tuple[float, ...], ...]) -> bool:
    key, found = "strike.table", len(reader.mistakes)
    if len(points) < 2:
        reader.refuse(
            key, f'curve = "table" needs 2 to {MAX_POINTS} points, each [m/s, level]; it has {len(points)}'
        )
        return False
    for at, (_, level) in enumerate(points, 1):
        if level > 1.0:
            reader.refuse(key, f"point {at} has the level {level:g}, outside 0 .. 1: give [m/s, level]")
    for at, (before, after) in enumerate(pairwise(points), 2):
        if after[0] <= before[0]:
            reader.refuse(
                key, f"point {at} has {after[0]:g} m/s after {before[0]:g} m/s: let the speeds rise"
            )
        if after[1] < before[1]:
            reader.refuse(
                key, f"point {at} has the level {after[1]:g} after {before[1]:g}: let no level fall"
            )
    return len(reader.mistakes) == found


def check_strike(reader: Reader, strike: Strike, drum: Drum) -> None:
    """Check what only several values together can get wrong: numbers that the curve or the drum does not use."""
    if strike.curve == "log" and not strike.softest_m_per_s < strike.full_scale_m_per_s:
        reader.refuse(
            "strike.softest_m_per_s",
            f"{strike.softest_m_per_s:g} m/s must be below full_scale_m_per_s, {strike.full_scale_m_per_s:g} m/s",
        )
    if strike.curve != "log" and strike.softest_m_per_s != SOFTEST_M_PER_S:
        reader.refuse("strike.softest_m_per_s", 'is for curve = "log": set it, or leave this out')
    if strike.curve != "table" and strike.table:
        reader.refuse("strike.table", 'is for curve = "table": set it, or leave this out')
    if strike.stroke_m_per_s > 0.0 and drum.excitation != "mallet":
        reader.refuse(
            "strike.stroke_m_per_s", 'is a mallet\'s: set [drum] excitation = "mallet", or leave this out'
        )
    if strike.soft_stroke_m_per_s > 0.0 and not strike.soft_stroke_m_per_s < strike.stroke_m_per_s:
        reader.refuse(
            "strike.soft_stroke_m_per_s",
            f"{strike.soft_stroke_m_per_s:g} m/s must be below stroke_m_per_s, {strike.stroke_m_per_s:g} m/s",
        )
