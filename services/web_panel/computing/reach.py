"""Rates and levels that can be asked for from the present values, for the picture on the page. Pure; blocks for half a
second.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from drumstick.analysis.inverse import Inverse, Roll, Unreachable
from drumstick.analysis.unpulsed import why_no_roll
from drumstick.parameters.scene import Scene
from drumstick.safety.envelope import Limits
from drumstick.scenes.table import Refusal
from web_panel.computing.computing_messages import Reach
from web_panel.computing.theory import live_law

SLOWEST_HZ, FASTEST_HZ = 2.0, 100.0  # the picture's ends
_LEVELS = 8
_SOFTEST = 0.02


def reach_of(scene: Scene, values: Mapping[str, float], limits: Mapping[str, float]) -> Reach:
    """`values` by wire names, SI; `limits` as envelope.Limits has them, or empty: those of the scene's guard."""
    if why := why_no_roll(scene):
        return Reach(why=why)
    given: dict[str, Any] = dict(limits)
    inverse = Inverse(scene, Limits(**given) if given else Limits.of(scene))
    try:
        now = inverse.present(live_law(scene, values))
    except Refusal as refusal:
        return Reach(why=str(refusal))
    rows: list[tuple[float, float, float]] = []
    for level in np.geomspace(_SOFTEST, 1.0, _LEVELS).tolist():
        start = _towards(inverse, now, level=level)
        slowest, fastest = (_towards(inverse, start, rate_Hz=rate) for rate in (SLOWEST_HZ, FASTEST_HZ))
        rows.append((start.level, slowest.rate_Hz, fastest.rate_Hz))
        if start.level < 0.99 * level:
            break
    levels, slow, fast = (list(column) for column in zip(*rows, strict=True))
    return Reach("", now.rate_Hz, now.level, levels, slow, fast)


def _towards(inverse: Inverse, now: Roll, rate_Hz: float | None = None, level: float | None = None) -> Roll:
    # As far as it goes.
    try:
        return inverse.towards(now, rate_Hz, level)
    except Unreachable as refusal:
        return refusal.nearest
