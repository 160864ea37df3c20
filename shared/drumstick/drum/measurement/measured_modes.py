"""Modes measured in a drum's rendered sound: pitch, error and level of each.

Any thread; blocks while it renders.
"""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene

Numbers = npt.NDArray[np.float64]

_SOFT_M_PER_S = 0.05  # too soft for a glide of the pitch
_PLACE = (0.37, 0.11)  # on no mode's node
_WAIT_S, _WINDOW_S = 0.1, 2.0
_NEAR_CENTS = 40.0


class MeasuredMode(NamedTuple):
    """(m, n): circles of nodes n - 1, diameters m. `found_Hz` is None where no peak is near the ideal head's mode."""

    m: int
    n: int
    ideal_Hz: float
    found_Hz: float | None
    cents: float | None
    level_dB: float | None


class MeasuredModes(NamedTuple):
    """The modes, lowest first, and the spectrum in which they were found: f (Hz) and level (dB), shape (n,)."""

    modes: list[MeasuredMode]
    f_Hz: Numbers
    level_dB: Numbers


def _ideal(count: int) -> list[tuple[float, int, int]]:
    from scipy import special

    bessel: Any = special
    found = [(float(zero), m, n) for m in range(count) for n, zero in enumerate(bessel.jn_zeros(m, count), 1)]
    return sorted(found)[:count]


def _peak(f_Hz: Numbers, level_dB: Numbers, ideal_Hz: float, within_cents: float) -> float | None:
    # The top near the ideal frequency, between two bins by a parabola; None where the level only rises past an edge.
    near = np.flatnonzero(np.abs(1200.0 * np.log2(f_Hz[1:] / ideal_Hz)) < within_cents) + 1
    top = int(near[np.argmax(level_dB[near])])
    if top in (near[0], near[-1]):
        return None
    below, at, above = level_dB[top - 1 : top + 2]
    return float(f_Hz[top] + 0.5 * (below - above) / (below - 2.0 * at + above) * (f_Hz[1] - f_Hz[0]))


def measured_modes(scene: Scene, rate_Hz: int, count: int = 12) -> MeasuredModes:
    """The first `count` modes of one soft strike, by the first pickup or microphone that is heard on the left."""
    sound = render(scene, [strike_for_speed(scene, _SOFT_M_PER_S, *_PLACE)], _WAIT_S + _WINDOW_S, rate_Hz)
    part = sound[round(_WAIT_S * rate_Hz) :, 0].astype(float)
    size = 8 * len(part)
    level = np.abs(np.fft.rfft(part * np.hanning(len(part)), size))
    f_Hz = np.fft.rfftfreq(size, 1.0 / rate_Hz).astype(np.float64)
    level_dB = (20.0 * np.log10(np.maximum(level / max(float(level.max()), 1e-300), 1e-9))).astype(np.float64)
    ideal = _ideal(count + 1)
    apart = [1200.0 * math.log2(high[0] / low[0]) for low, high in pairwise(ideal)]
    modes: list[MeasuredMode] = []
    for k, (zero, m, n) in enumerate(ideal[:count]):
        ideal_Hz = scene.drum.f01_Hz * zero / J01
        found_Hz = _peak(f_Hz, level_dB, ideal_Hz, min(_NEAR_CENTS, 0.5 * min(apart[max(k - 1, 0) : k + 1])))
        if found_Hz is None:
            modes.append(MeasuredMode(m, n, ideal_Hz, None, None, None))
            continue
        top_dB = float(level_dB[np.argmin(np.abs(f_Hz - found_Hz))])
        modes.append(MeasuredMode(m, n, ideal_Hz, found_Hz, 1200.0 * math.log2(found_Hz / ideal_Hz), top_dB))
    return MeasuredModes(modes, f_Hz, level_dB)
