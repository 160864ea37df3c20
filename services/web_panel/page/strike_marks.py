"""Marks on the head where the stick struck, which fade. Main thread."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import viser

from protocol.messages import Strike

_COUNT = 6
_LIFE_S = 2.5
_SAME_PLACE = 0.05  # radii: a roll keeps one mark alive
_ABOVE_HEAD = 0.02
_FADE_STEPS = 10  # a change smaller than this is not sent


@dataclass
class _Spot:
    handle: viser.CylinderHandle
    x: float = 0.0
    y: float = 0.0
    struck_at: float = float("-inf")
    step: int = 0


def faded(age_s: float) -> int:
    """Remaining strength of a mark, 10 when it is made, 0 at its end, in whole steps."""
    return round(_FADE_STEPS * (1.0 - min(max(age_s / _LIFE_S, 0.0), 1.0)))


class StrikeMarks:
    """Six marks by turns; the one that has faded most is the next."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._spots = [
            _Spot(
                scene.add_cylinder(
                    f"/spots/{i}",
                    1.0,
                    0.004,
                    (242, 150, 40),
                    opacity=1.0,
                    cast_shadow=False,
                    receive_shadow=False,
                    radial_segments=48,
                    visible=False,
                )
            )
            for i in range(_COUNT)
        ]

    def show(
        self, strikes: Iterable[tuple[float, Strike]], height_at: Callable[[float, float], float], now: float
    ) -> None:
        """Mark the new strikes; let the others fade, and ride on the head."""
        for at, strike in strikes:
            self._mark(strike, at)
        for spot in self._spots:
            step = faded(now - spot.struck_at)
            if step != spot.step:
                spot.step = step
                spot.handle.visible = step > 0
                spot.handle.opacity = step / _FADE_STEPS
            if step > 0:
                place = np.array((spot.x, spot.y, _ABOVE_HEAD + height_at(spot.x, spot.y)))
                if np.max(np.abs(place - spot.handle.position)) > 2e-3:
                    spot.handle.position = place

    def _mark(self, strike: Strike, at: float) -> None:
        near = [s for s in self._spots if s.step and abs(s.x - strike.x) + abs(s.y - strike.y) < _SAME_PLACE]
        spot = near[0] if near else min(self._spots, key=lambda s: s.struck_at)
        spot.x, spot.y, spot.struck_at = strike.x, strike.y, at
        size = round(0.05 + 0.2 * min(max(strike.level, 0.0), 1.0), 2)
        if spot.handle.scale != size:
            spot.handle.scale = size
