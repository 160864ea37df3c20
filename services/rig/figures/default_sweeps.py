"""The sweeps that `drumstick analyse --out` runs when none is asked for, about the scene's own values."""

import numpy as np

from drumstick.analysis.cycles.sweep import Axis
from drumstick.parameters.scene import Scene
from drumstick.scenes.table import Z_H0, table_of, values_of
from drumstick.stick.law import law_of

LINE_POINTS, FORECAST_POINTS, PLANE_POINTS = 240, 36, 41
# How strong a pulse is, and over which factors below and above the scene's own. gamma stands beside beta in
# alpha (beta + gamma): a little less and nothing rolls, a little more and nothing settles.
_STRENGTHS = {"dv_pls": (10.0, 3.0), "gamma": (1.5, 1.4)}
_BESIDE_M = 0.0175  # how far the hand is moved up and down


def strength(scene: Scene) -> str | None:
    """The parameter that says how strong the scene's pulse is; None when it has no pulse."""
    table = table_of(scene)
    return next((name for name in _STRENGTHS if name in table), None)


def _about(
    scene: Scene, name: str, down: float, up: float, instead: tuple[float, float], points: int
) -> Axis:
    # Logarithmic, from own/down to own*up; `instead` where the scene's own value is 0.
    row = table_of(scene)[name]
    own = values_of(law_of(scene), table_of(scene))[name]
    low, high = (own / down, own * up) if own > 0.0 else instead
    low, high = max(low, row.quantity.low), min(high, row.quantity.high)
    return Axis(name, np.geomspace(low, high, points) if low > 0.0 else np.linspace(low, high, points))


def line(scene: Scene, points: int = LINE_POINTS) -> Axis | None:
    """The strength of the pulse, over what is of interest about the scene's own; None without a pulse."""
    name = strength(scene)
    if name is None:
        return None
    down, up = _STRENGTHS[name]
    return _about(scene, name, down, up, (0.01, 1.0), points)


def planes(scene: Scene) -> list[tuple[Axis, ...]]:
    """Stiffness against height of the hand; with a pulse also its strength against the stiffness."""
    hand = _about(scene, "k_hand", 4.0, 10.0, (1.0, 200.0), PLANE_POINTS)
    own = values_of(law_of(scene), table_of(scene))[Z_H0]
    middle = own if np.isfinite(own) else scene.stick.z_ss_m
    quantity = table_of(scene)[Z_H0].quantity
    low, high = max(middle - _BESIDE_M, quantity.low), min(middle + _BESIDE_M, quantity.high)
    pairs: list[tuple[Axis, ...]] = [(hand, Axis(Z_H0, np.linspace(low, high, PLANE_POINTS)))]
    pulse = line(scene, PLANE_POINTS)
    if pulse is not None:
        pairs.append((pulse, hand))
    return pairs
