"""The head's surface as a mesh for the picture: where its corners lie, and how much it is exaggerated. Pure.

Lengths are radii of the head.
"""

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from protocol.messages import Membrane

Corners = npt.NDArray[np.float32]
Faces = npt.NDArray[np.uint32]

_MAX_CORNERS = 4096  # a sound server of ours sends 769
_TALLEST = 0.3  # radii, of the picture
_TALL_SHARE = (
    95.0  # per cent of the head are lower: where the stick pushes, a point stands out for an instant
)
_REMEMBERED_S = 10.0
_QUIETEST_M = 1e-7
_HIGHEST_M = 10.0


def heights_of(surface: Membrane) -> npt.NDArray[np.float64]:
    """Heights in m, shape (1 + rings * spokes,). ValueError where the message does not hold as many."""
    count = 1 + surface.rings * surface.spokes
    if not (surface.rings >= 1 and surface.spokes >= 3 and count <= _MAX_CORNERS):
        raise ValueError(f"a surface of {surface.rings} rings with {surface.spokes} spokes cannot be shown")
    if len(surface.heights) != 2 * count:
        raise ValueError(f"{len(surface.heights)} bytes of heights are not {count} heights")
    heights = surface.unit_m * np.frombuffer(surface.heights, "<i2").astype(np.float64)
    if not np.abs(heights).max() <= _HIGHEST_M:
        raise ValueError(f"a surface whose unit is {surface.unit_m} m cannot be shown")
    return heights


def disc(rings: int, spokes: int) -> tuple[Corners, Faces]:
    """A flat head: corners (1 + (rings + 1) * spokes, 3), the centre first and the rim last; faces (n, 3)."""
    r = np.repeat(np.arange(1, rings + 2) / (rings + 1), spokes)
    angle = np.tile(2.0 * math.pi * np.arange(spokes) / spokes, rings + 1)
    corners = np.zeros((1 + len(r), 3), np.float32)
    corners[1:, 0], corners[1:, 1] = r * np.cos(angle), r * np.sin(angle)
    here = np.arange(spokes)
    beside = (here + 1) % spokes
    faces = [np.column_stack([np.zeros_like(here), 1 + here, 1 + beside])]
    for ring in range(rings):
        inner, outer = 1 + ring * spokes, 1 + (ring + 1) * spokes
        faces.append(np.column_stack([inner + here, outer + here, outer + beside]))
        faces.append(np.column_stack([inner + here, outer + beside, inner + beside]))
    return corners, np.concatenate(faces).astype(np.uint32)


def hoop(inner: float, outer: float, bottom: float, top: float, segments: int = 96) -> tuple[Corners, Faces]:
    """A tube without floor or lid, so that the head may swing inside it: outside wall, upper edge, inside wall."""
    return revolved(((bottom, outer), (top, outer), (top, inner), (bottom, inner)), segments)


def revolved(profile: Sequence[tuple[float, float]], segments: int) -> tuple[Corners, Faces]:
    """A surface of revolution about z; `profile` has rows of (z, radius)."""
    angle = 2.0 * math.pi * np.arange(segments) / segments
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    corners = np.concatenate([np.column_stack([r * around, np.full(segments, z)]) for z, r in profile])
    here = np.arange(segments)
    beside = (here + 1) % segments
    faces: list[npt.NDArray[np.int64]] = []
    for wall in range(len(profile) - 1):
        low, high = wall * segments, (wall + 1) * segments
        faces.append(np.column_stack([low + here, low + beside, high + beside]))
        faces.append(np.column_stack([low + here, high + beside, high + here]))
    return corners.astype(np.float32), np.concatenate(faces).astype(np.uint32)


def tallness(heights: npt.NDArray[np.float64]) -> float:
    """Height of a surface, m."""
    return float(np.percentile(np.abs(heights), _TALL_SHARE))


class Exaggeration:
    """Factor by which heights are drawn larger: 1, 2 or 5 times a power of ten, so that the tallest of the last ten
    seconds fills the picture. It changes rarely: a soft stroke must look softer than a loud one."""

    def __init__(self) -> None:
        self._tallest: deque[tuple[float, float]] = deque()  # falling
        self.times = 1.0

    def of(self, tallest_m: float, radius_m: float, now: float) -> float:
        """The factor, once a surface this tall was seen at `now` (s)."""
        while self._tallest and self._tallest[0][0] < now - _REMEMBERED_S:
            self._tallest.popleft()
        while self._tallest and self._tallest[-1][1] <= tallest_m:
            self._tallest.pop()
        self._tallest.append((now, tallest_m))
        most_m = self._tallest[0][1]
        if most_m > _QUIETEST_M:
            wanted = _TALLEST * radius_m / most_m
            # Not to and fro between two steps: up only when there is room to spare.
            if wanted < self.times or wanted > 4.0 * self.times:
                self.times = _round_down(wanted)
        return self.times


def _round_down(value: float) -> float:
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{m * power:.3g}") for m in (5, 2, 1) if m * power <= value * 1.000001)
