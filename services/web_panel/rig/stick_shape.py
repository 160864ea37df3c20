"""The stick of the pictures: its shape, and where the hand holds it. Pure; lengths in radii of the head.

A device reports one point, the tip. Shape and hold are those of a usual 5A stick, turned about a hand that follows the
tip across the head, stands as high as the hand's spring is held (z_h0), and rises with a stick that is lifted far.
"""

import math
from typing import NamedTuple

Point = tuple[float, float, float]

_LENGTH_M, _HELD_M = 0.407, 0.27  # a 5A; from the tip to the middle of the grip
_BEAD_M, _BEAD_LONG_M = 0.0055, 0.016
# Along the stick, and its radius there: bead, taper, shaft; the grip's wrap; the end on the hand's side.
_SHAFT_M = ((0.0155, 0.0035), (0.03, 0.0042), (0.11, 0.0072), (_HELD_M - 0.05, 0.0072))
_GRIP_M = (
    (_HELD_M - 0.05, 0.0072), (_HELD_M - 0.047, 0.0088), (_HELD_M + 0.047, 0.0088), (_HELD_M + 0.05, 0.0072),
)  # fmt: skip
_BUTT_M = (
    (_HELD_M + 0.05, 0.0072),
    (_LENGTH_M - 0.004, 0.0072),
    (_LENGTH_M - 0.001, 0.005),
    (_LENGTH_M, 0.0),
)
# From the tip to the grip, towards the player's right hand: across the head, and upwards, m.
_TOWARDS = (0.64, -0.77)
_RISE_M = 0.085
_WRIST_M = 0.06  # the wrist lifts the tip so far by itself
_LOWEST, _HIGHEST = -0.5, 3.0


class StickShape(NamedTuple):
    """Profiles about the stick's axis: rows of (along the stick, radius), from the tip. `bead`: the tip's radius."""

    bead: float
    tip: tuple[tuple[float, float], ...]
    shaft: tuple[tuple[float, float], ...]
    grip: tuple[tuple[float, float], ...]
    butt: tuple[tuple[float, float], ...]

    def pose(self, tip: Point, grip: Point) -> tuple[Point, tuple[float, float, float, float]]:
        """Place of the stick's end whose bead touches `tip` from above, and the turn (w, x, y, z) that takes +z from
        there to the grip."""
        apart = math.dist(tip, grip)
        x, y, z = ((b - a) / apart for a, b in zip(tip, grip, strict=True))
        middle = 0.5 * _BEAD_LONG_M / _BEAD_M * self.bead
        place = (tip[0] - middle * x, tip[1] - middle * y, tip[2] + self.bead - middle * z)
        half = math.sqrt(2.0 * (1.0 + z))
        return place, (0.5 * half, -y / half, x / half, 0.0)


def stick_shape(radius_m: float) -> StickShape:
    """A stick of true size beside a head of this radius."""

    def scaled(rows: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        return tuple((along / radius_m, thick / radius_m) for along, thick in rows)

    turns = [math.pi * i / 8 for i in range(8)]
    bead = tuple((0.5 * _BEAD_LONG_M * (1.0 - math.cos(a)), _BEAD_M * math.sin(a)) for a in turns)
    return StickShape(
        _BEAD_M / radius_m, scaled((*bead, _SHAFT_M[0])), scaled(_SHAFT_M), scaled(_GRIP_M), scaled(_BUTT_M)
    )


def height_of(z_m: float, radius_m: float) -> float:
    """Height of the tip in the picture, which ends somewhere."""
    return min(max(z_m / radius_m, _LOWEST), _HIGHEST)


def grip_of(tip: Point, z_h0_m: float, radius_m: float) -> Point:
    """Middle of the grip, for a tip that is there."""
    hand = min(max(z_h0_m / radius_m, -1.0), 1.0)
    across = math.sqrt(_HELD_M**2 - _RISE_M**2) / (radius_m * math.hypot(*_TOWARDS))
    lifted = max(0.0, tip[2] - hand - _WRIST_M / radius_m)
    return (
        tip[0] + across * _TOWARDS[0],
        tip[1] + across * _TOWARDS[1],
        _RISE_M / radius_m + hand + lifted,
    )
