"""Places of pickups as live parameters, in a scene that asks for them: `[listen] pickup_places = "live"`."""

import dataclasses
import math
from collections.abc import Mapping

from drumstick.parameters.declare import Quantity
from drumstick.parameters.drum import Listen

_LIMIT = 1.0  # of the radius: the rim
_ROUNDING = 1e-6  # of single precision, in which OSC brings 0.6 and 0.8


def _rows(listen: Listen) -> dict[str, tuple[int, int]]:
    # Wire name -> which pickup, and which of its numbers.
    count = len(listen.pickups) if listen.pickup_places == "live" else 0
    return {f"pickup-{n + 1}.{axis}": (n, at) for n in range(count) for at, axis in enumerate("xy")}


def live_pickups(listen: Listen) -> dict[str, tuple[Quantity, float]]:
    """Wire name -> declaration and the scene's own value of each coordinate; empty where the pickups stay."""
    return {
        name: (
            Quantity(
                float,
                -_LIMIT,
                _LIMIT,
                "of the radius",
                f"Place of pickup {n + 1} on the head: {name[-1]}",
                wire=name,
            ),
            listen.pickups[n][at],
        )
        for name, (n, at) in _rows(listen).items()
    }


def with_pickups_at(listen: Listen, values: Mapping[str, float]) -> Listen:
    """The table with its pickups at these coordinates by wire name; other names are ignored."""
    pickups = [list(pickup) for pickup in listen.pickups]
    for name, (n, at) in _rows(listen).items():
        pickups[n][at] = values.get(name, pickups[n][at])
    return dataclasses.replace(listen, pickups=tuple(map(tuple, pickups)))


def pickups_off_head(listen: Listen) -> list[str]:
    """Mistakes in the places of pickups that can be set live, in words; empty where there are none."""
    if listen.pickup_places != "live":
        return []
    return [
        f"pickup {number} at x {x:g}, y {y:g} of the radius is {math.hypot(x, y):.3g} from the middle, outside the rim,"
        f" at most {_LIMIT:g} of the radius: move it nearer to the middle"
        for number, (x, y, _) in enumerate(listen.pickups, 1)
        if not math.hypot(x, y) <= _LIMIT + _ROUNDING
    ]
