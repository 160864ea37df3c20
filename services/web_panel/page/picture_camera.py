"""Camera of the drum's picture: drum and stick are whole in a window of any shape. Pure.

Lengths are in radii of the head.
"""

import math
from functools import lru_cache

import numpy as np

from web_panel.rig.stick_shape import Point, grip_of, stick_shape

_EYE_WARDS = np.array((0.0, -3.2, 2.4)) / 4.0  # of length 1: from what is looked at to the eye
_RIGHT = np.array((1.0, 0.0, 0.0))
_TAN = math.tan(math.radians(0.5 * 75.0))  # viser's angle of sight, upright
_MARGIN = 1.05
_STEP = 0.1  # a window of nearly the same shape leaves the picture as somebody has turned it
# Where the tip may be: a scene's strokes walk across most of the head.
_TIPS: tuple[Point, ...] = ((0.75, 0.0, 0.0), (0.0, 0.75, 0.6), (0.4, -0.4, 0.0), (0.0, 0.0, 1.0))
_SHELL = (
    (-1.07, 0.0, 0.0),
    (0.0, 1.07, 0.0),
    (-0.76, -0.76, -0.54),
    (0.0, -1.07, -0.85),
    (0.0, -1.04, -0.54),
)


@lru_cache(maxsize=8)
def _seen(radius_m: float) -> np.ndarray:
    ends: list[Point] = []
    shape = stick_shape(radius_m)
    for tip in _TIPS:
        grip = grip_of(tip, 0.0, radius_m)
        times = shape.butt[-1][0] / math.dist(tip, grip)
        ends.append(tuple(a + times * (b - a) for a, b in zip(tip, grip, strict=True)))  # type: ignore[arg-type]
    return np.array((*_SHELL, *ends))


def camera_for(aspect: float, radius_m: float) -> tuple[Point, Point]:
    """The eye, and what it looks at, for a head of this radius; `aspect` > 0 is the picture's width over its height."""
    points = _seen(radius_m)
    look_at = 0.5 * (points.min(axis=0) + points.max(axis=0))
    apart = points - look_at
    up = np.cross(_EYE_WARDS, _RIGHT)
    across, high, near = np.abs(apart @ _RIGHT), np.abs(apart @ up), apart @ _EYE_WARDS
    far = float(np.max(np.maximum(across / aspect, high) * _MARGIN / _TAN + near))
    eye = look_at + math.ceil(far / _STEP) * _STEP * _EYE_WARDS
    return _point(eye), _point(look_at)


def _point(of: np.ndarray) -> Point:
    return float(of[0]), float(of[1]), float(of[2])
