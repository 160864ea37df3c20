"""Patches on the head of a bank of modes: by how much each mode is damped. Any thread; allocates.

A patch whose resistance is R per area takes R |u'|^2 of each place under it. Of a mode with the shape phi that is, to
first order, an additional decay of R int_patch phi^2/(2 sigma int phi^2), with sigma the head's mass per area: the
patch's own decay, 3 ln 10/t60, times the share of phi^2 that lies under it. A mesh damps the junctions under a patch by
that very decay (drumstick.drum.effects.muffle), in air too, so both mean the same by a t60. What a patch couples
between modes of different pitch is of second order in its decay over their distance, and left out: one that takes a
mode away in a few of its periods bends the shapes, and this does not tell.

The two modes of a pair, cos(m phi) and sin(m phi), have one pitch, and a patch beside the x axis couples them however
light it is. So each pair is turned, by at most an eighth of a circle in its own plane, until its two are damped apart.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import head_numbers
from drumstick.drum.modal.air_load import Load, load_of, under_load
from drumstick.drum.modal.modes import radial_shapes
from drumstick.parameters.drum import Drum

_LEAST_RINGS, _RINGS_A_RADIAN = 400, 2.0
_APART = 1e-9  # a smaller part of a pair's damping couples nothing: rounding

Numbers = npt.NDArray[np.float64]
Patches = tuple[tuple[float, ...], ...]


class Covered(NamedTuple):
    """shares (2 P,): of each mode's phi^2, under the patches; turn (2, P): cosine and sine of each pair's angle; t60_s:
    of the head under a patch by the patch alone."""

    shares: Numbers
    turn: Numbers
    t60_s: float


def covered_by(highest: float, drum: Drum) -> Covered | None:
    """Shares and turns of the drum's modes up to this zero under its patches; None where nothing lies on the head."""
    patches = head_numbers.damping_patches(drum)
    if patches is None:
        return None
    shares, turn = _shares(patches[0], highest, drum.f01_Hz, load_of(drum))
    return Covered(shares, turn, patches[1])


def turned(values: Numbers, covered: Covered | None) -> Numbers:
    """Values of pairs as they are turned, shape (..., 2 P), from those of cos(m phi) and sin(m phi)."""
    if covered is None:
        return values
    cosine, sine = covered.turn
    first, second = np.split(values, 2, axis=-1)
    return np.concatenate([cosine * first + sine * second, cosine * second - sine * first], axis=-1)


def _arcs(patches: Patches, radii: Numbers, orders: int) -> tuple[Numbers, Numbers]:
    # int cos(2 m phi) and int sin(2 m phi) over what of each circle is under a patch, (orders, radii).
    ends = [np.zeros(len(radii)), np.full(len(radii), 2.0 * math.pi)]
    for x, y, radius in patches:
        away, middle = math.hypot(x, y), math.atan2(y, x)
        across = np.maximum(2.0 * radii * away, 1e-12)
        half = np.arccos(np.clip((radii**2 + away**2 - radius**2) / across, -1.0, 1.0))
        ends += [np.mod(middle - half, 2.0 * math.pi), np.mod(middle + half, 2.0 * math.pi)]
    edges = np.sort(np.array(ends), axis=0)
    begin, end = edges[:-1], edges[1:]
    middles = 0.5 * (begin + end)
    under = np.zeros(middles.shape, bool)
    for x, y, radius in patches:
        under |= np.hypot(radii * np.cos(middles) - x, radii * np.sin(middles) - y) <= abs(radius)
    cosines, sines = np.zeros((2, orders, len(radii)))
    cosines[0] = np.sum(under * (end - begin), axis=0)
    for m in range(1, orders):
        cosines[m] = np.sum(under * (np.sin(2 * m * end) - np.sin(2 * m * begin)), axis=0) / (2 * m)
        sines[m] = np.sum(under * (np.cos(2 * m * begin) - np.cos(2 * m * end)), axis=0) / (2 * m)
    return cosines, sines


@functools.lru_cache(maxsize=8)  # an engine is built some times over until its level is found
def _shares(patches: Patches, highest: float, f01_Hz: float, load: Load | None) -> tuple[Numbers, Numbers]:
    head = under_load(highest, f01_Hz, load)
    modes = head.modes
    rings = max(_LEAST_RINGS, math.ceil(_RINGS_A_RADIAN * float(head.basis.zeros[-1])))
    radii = np.linspace(0.0, 1.0, rings + 1)
    squares = head.mixed(radial_shapes(head.basis, radii)) ** 2 * (radii / rings)[:, None]
    cosines, sines = _arcs(patches, radii, int(modes.orders.max()) + 1)
    whole = cosines[0] @ squares
    apart, coupled = np.zeros((2, len(modes.orders)))
    for m in range(1, len(cosines)):
        own = modes.orders == m
        apart[own], coupled[own] = cosines[m] @ squares[:, own], sines[m] @ squares[:, own]
    coupled[np.abs(coupled) <= _APART * whole] = 0.0
    sign = np.where(apart < 0.0, -1.0, 1.0)
    angle = 0.5 * np.arctan2(sign * coupled, np.abs(apart))
    split = sign * np.hypot(apart, coupled)
    pair = np.where(modes.orders == 0, 2.0, 1.0)  # of a round mode the second is never driven
    shares = np.concatenate([whole + split, whole - split]) * np.tile(0.5 * pair / modes.norms, 2)
    shares, turn = np.clip(shares, 0.0, 1.0), np.array([np.cos(angle), np.sin(angle)])
    for values in (shares, turn):
        values.setflags(write=False)
    return shares, turn
