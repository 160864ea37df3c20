"""The modes of a mesh as it is computed, against the ideal membrane's. Any thread; needs scipy.

A mode of the lattice is a pattern v with A v = -a v. One step with v as the present, and one with v as the past, tell
by which factor c1 and c2 the step takes it over: v(n+1) = c1 v(n) + c2 v(n-1), whose poles R exp(+-i theta) are the
mode's pitch and decay (Bilbao, "Numerical Sound Synthesis", 2009, 3.3). So it is the step itself that is measured,
with its rounding, not what its coefficients were meant to be.
"""

import math
from collections.abc import Callable
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import J01, Lattice
from drumstick.drum.membrane.scheme import Scheme
from drumstick.drum.modal.modes import modes_below

MODES = 20  # the lowest, a pair counts twice
_AS_MANY_ZEROS = 12.0  # J_m has zeros for more than twenty modes below this one
_SPARE = 6  # asked of the eigenvalue solver beyond those wanted: a pair at the end comes whole
_NEPERS = 3.0 * math.log(10.0)  # 60 dB
_LARGE_CENTS = 10.0
_DIRECTIONS = 7  # of a wave, from 0 on to where the lattice looks the same again
_WAVENUMBERS = 4000

Numbers = npt.NDArray[np.float64]
# From u and u-, on the junctions inside the rim, to u+.
Step = Callable[[Numbers, Numbers], Numbers]


def ideal_ratios() -> Numbers:
    """Frequencies of the ideal membrane's first twenty modes, over the lowest: Bessel zeros."""
    modes = modes_below(_AS_MANY_ZEROS)
    twice = [
        zero for m, zero in zip(modes.orders, modes.zeros, strict=True) for _ in range(1 if m == 0 else 2)
    ]
    return np.array(twice[:MODES]) / J01


class Patterns(NamedTuple):
    """The lowest modes: `places`, flat indices of the junctions inside (J,); `shapes` and `duals` (20, J), with
    duals @ shapes.T the identity."""

    places: npt.NDArray[np.int64]
    shapes: Numbers
    duals: Numbers


def _pairs(lattice: Lattice) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    # Every two neighbours inside the rim once, by their numbers among the junctions inside.
    number = np.full(lattice.weights.shape, -1, np.int64)
    rows, columns = np.nonzero(lattice.weights)
    number[rows, columns] = np.arange(len(rows))
    odd = (rows - lattice.centre_row) & 1
    ways: list[tuple[int, Any]] = (
        [(0, 1), (1, odd), (1, odd - 1)] if lattice.topology.shifted else [(0, 1), (1, 0)]
    )
    one: list[npt.NDArray[np.int64]] = []
    other: list[npt.NDArray[np.int64]] = []
    for down, along in ways:
        beside = number[rows + down, columns + along]
        one.append(np.flatnonzero(beside >= 0))
        other.append(beside[beside >= 0])
    return np.concatenate(one), np.concatenate(other)


def patterns_of(lattice: Lattice) -> Patterns:
    """The lattice's lowest modes, in float64."""
    from scipy import sparse
    from scipy.sparse import linalg

    algebra, solver = cast(Any, sparse), cast(Any, linalg)
    places = np.flatnonzero(lattice.weights)
    root = np.sqrt(lattice.weights.ravel()[places])
    one, other = _pairs(lattice)
    half = algebra.coo_array((root[one] * root[other], (one, other)), shape=(len(places), len(places)))
    minus_laplacian = (algebra.eye_array(len(places)) - half - half.T).tocsc()
    begin = np.random.default_rng(1).standard_normal(len(places))
    a, found = solver.eigsh(minus_laplacian, k=MODES + _SPARE, sigma=0.0, v0=begin)
    lowest = np.argsort(a)[:MODES]
    columns: Numbers = found[:, lowest]
    return Patterns(places, (columns * root[:, None]).T, (columns / root[:, None]).T)


class Poles(NamedTuple):
    """f_Hz and t60_s of each mode, (20,); t60_s is infinite where nothing is lost."""

    f_Hz: Numbers
    t60_s: Numbers


def poles_of(turn: Numbers, kept: Numbers, step_s: float) -> Poles:
    """Poles of v(n+1) = turn v(n) - kept v(n-1), all of shape (20,)."""
    theta = np.arccos(np.clip(0.5 * turn / np.sqrt(kept), -1.0, 1.0))
    with np.errstate(divide="ignore"):
        t60_s = np.where(kept < 1.0, -2.0 * _NEPERS * step_s / np.log(kept), np.inf)
    return Poles(theta / (2.0 * math.pi * step_s), t60_s)


def measured(step: Step, patterns: Patterns, step_s: float) -> Poles:
    """The poles of each pattern by two steps."""
    none = np.zeros(len(patterns.places))
    taken = list(zip(patterns.shapes, patterns.duals, strict=True))
    present = np.array([dual @ step(shape, none) for shape, dual in taken])
    past = np.array([dual @ step(none, shape) for shape, dual in taken])
    return poles_of(present, -past, step_s)


def cents_off(f_Hz: Numbers, t60_s: float) -> Numbers:
    """Pitch error of each mode against the ideal membrane's, the lowest taken as in tune.

    The ideal one decays as this one should, every mode alike, which lowers its lowest mode by some hundredths of a
    cent: w^2 = w0^2 - sigma^2 with w0 in the ratios of the Bessel zeros.
    """
    slowed = (_NEPERS / t60_s / (2.0 * math.pi)) ** 2
    ideal = np.sqrt(ideal_ratios() ** 2 * (f_Hz[0] ** 2 + slowed) - slowed)
    return 1200.0 * np.log2(f_Hz / ideal)


def decay_error(t60_s: Numbers, due_s: float) -> float:
    """The largest relative error of T60."""
    return float(np.abs(t60_s / due_s - 1.0).max())


def dispersion(scheme: Scheme, kh: Numbers, way: float) -> tuple[Numbers, Numbers]:
    """A plane wave's turn a step, radians, and its pitch error, cents; kh: wavenumber times spacing, way: its angle.

    By the scheme's dispersion relation without losses (von Neumann): q = tau a - order_4 a^2 = 2 - 2 cos(theta) with
    a = 1 - mean of cos(k h . d) over the neighbours' directions d.
    """
    neighbours = scheme.topology.neighbours
    turns = way + 2.0 * math.pi * np.arange(neighbours) / neighbours
    a = 1.0 - np.cos(np.outer(np.cos(turns), kh)).mean(axis=0)
    theta = np.arccos(np.clip(1.0 - 0.5 * (scheme.tau * a - scheme.order_4 * a * a), -1.0, 1.0))
    ideal = math.sqrt(scheme.tau) / 2.0 * kh  # c T/h k h
    return theta, 1200.0 * np.log2(theta / ideal)


def bandwidth(scheme: Scheme) -> float:
    """Frequency at which a plane wave is 10 cents off, in the worst direction, as a part of the step rate."""
    kh = np.linspace(0.0, math.pi, _WAVENUMBERS + 1)[1:]
    lowest = 0.5
    for way in np.linspace(0.0, math.pi / scheme.topology.neighbours, _DIRECTIONS):
        theta, cents = dispersion(scheme, kh, float(way))
        off = np.abs(cents) > _LARGE_CENTS
        if off.any():
            lowest = min(lowest, float(theta[np.argmax(off)]) / (2.0 * math.pi))
    return lowest
