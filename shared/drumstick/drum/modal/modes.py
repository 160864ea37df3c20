"""The modes of an ideal circular membrane, and a bank that plays them. Any thread; allocates.

A mode is J_m(j r) cos(m phi) or sin(m phi) with j a zero of J_m; its frequency is f01 j/j01. A force F at a point moves
it by q'' + 2 sigma q' + w^2 q = c^2 F shape(point) / norm, with c the speed of waves in radii a second, where the
tension is 1, and norm = pi J_{m+1}(j)^2 for m = 0, half of that for each of a pair (Morse and Ingard, "Theoretical
acoustics", 5.2). The bank's oscillators answer to a force that is constant over a step as the sampled mode does to the
same impulse.
"""

import math
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.excitation.analytic import POOL
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.modal.bank import Bank
from drumstick.drum.output.upsample import PASS_BAND
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from realtime.records import ABSENT

MAX_MODES = 20_000  # of 0.3 to 0.5 ns each and a step: two fifths of a core at 48 kHz
_RADII_A_RADIAN = 2.0  # of the table of shapes, per radian of the shortest wave
_SPLINE_STEP = 0.15  # radians
_NEPERS = 3.0 * math.log(10.0)  # 60 dB

Numbers = npt.NDArray[np.float64]


def _bessel() -> Any:
    # Loaded only where a scene has a bank of modes: it takes a quarter of a second.
    from scipy import special

    return special


class Modes(NamedTuple):
    """Shapes (P,), the lowest first: the order m of each radial mode, the zero j, its norm."""

    orders: npt.NDArray[np.int64]
    zeros: Numbers
    norms: Numbers


def modes_below(highest: float) -> Modes:
    """All whose zero j is at most `highest` (and the lowest in any case)."""
    bessel = _bessel()
    found: list[tuple[float, int]] = [(J01, 0)]
    order = 0
    while True:
        count = max(1, math.ceil((highest - order) / math.pi) + 1)
        zeros = [float(j) for j in bessel.jn_zeros(order, count) if j <= highest]
        if not zeros:
            break
        found += [(j, order) for j in zeros if j > J01 + 1e-9]
        order += 1
    found.sort()
    orders = np.array([m for _, m in found], np.int64)
    zeros = np.array([j for j, _ in found])
    norms = math.pi * bessel.jv(orders + 1, zeros) ** 2 * np.where(orders == 0, 1.0, 0.5)
    return Modes(orders, zeros, norms)


def shapes_at(modes: Modes, x: float, y: float) -> tuple[Numbers, Numbers]:
    """J_m(j r) cos(m phi) and J_m(j r) sin(m phi) at a place in radii; shapes (P,)."""
    bessel = _bessel()
    radial = bessel.jv(modes.orders, modes.zeros * min(math.hypot(x, y), 1.0))
    angle = modes.orders * math.atan2(y, x)
    return radial * np.cos(angle), radial * np.sin(angle)


def decay_rates(drum: Drum, f_Hz: Numbers) -> Numbers:
    """sigma of each frequency, 1/s: the drum's own decay, and what its losses add."""
    inverse = np.full(len(f_Hz), 1.0 / drum.t60_s)
    if "air_loss" in drum.effects:
        inverse += 1.0 / drum.effects["air_loss"].t60_s
    if "internal_loss" in drum.effects:
        high = drum.effects["internal_loss"]
        lowest = float(inverse[0])
        rise = max(1.0 / high.t60_s - lowest, 0.0) / (high.at_Hz**2 - drum.f01_Hz**2)
        inverse += rise * np.maximum(f_Hz**2 - drum.f01_Hz**2, 0.0)
    return _NEPERS * inverse


def highest_zero(scene: Scene, rate_Hz: float) -> float:
    """j of the highest mode that the scene asks for, that fits below half the rate, and that the bank has room for."""
    assert scene.modal is not None
    top_Hz = min(scene.modal.top_Hz, 0.45 * rate_Hz)
    most = 2.0 * math.sqrt(MAX_MODES)  # Weyl: (j/2)^2 modes, pairs counted
    return max(min(top_Hz / scene.drum.f01_Hz * J01, most), J01)


def divisor_below(scene: Scene, rate_Hz: int) -> int:
    """Device samples a step: as many as leave the scene's highest mode in the interpolator's pass band."""
    assert scene.modal is not None
    return max(1, math.floor(PASS_BAND * rate_Hz / scene.modal.top_Hz))


def radial_shapes(modes: Modes, radii: Numbers) -> Numbers:
    """J_m(j r) of each mode at each radius, shape (radii, P), true to 1e-5.

    By a cubic spline through each order's function: the function itself, asked a million times, takes seconds.
    """
    from scipy import interpolate

    bessel, splines = _bessel(), cast(Any, interpolate)
    first, last = float(modes.zeros[-1] * radii[0]), float(modes.zeros[-1] * radii[-1])
    x: Numbers = np.linspace(first, last, math.ceil((last - first) / _SPLINE_STEP) + 1)
    found = np.zeros((len(radii), len(modes.zeros)))
    for order in range(int(modes.orders.max()) + 1):
        own = modes.orders == order
        found[:, own] = splines.CubicSpline(x, bessel.jv(order, x))(np.outer(radii, modes.zeros[own]))
    return found


def left_under_tip(modes: Modes, radius: float) -> Numbers:
    """A mode's mean under a mallet's tip, by its shape in the tip's middle: see drumstick.drum.mallets.shares."""
    a = modes.zeros * radius
    return 8.0 * _bessel().jv(2, a) / a**2


def bank_of(scene: Scene, step_s: float) -> Bank:
    """The scene's drum at rest, a step every `step_s`."""
    modes = modes_below(highest_zero(scene, 1.0 / step_s))
    f_Hz = scene.drum.f01_Hz * modes.zeros / J01
    left_a_step = np.exp(-decay_rates(scene.drum, f_Hz) * step_s)  # R
    theta = 2.0 * math.pi * f_Hz * step_s
    bend = 1.0 - 2.0 * left_a_step * np.cos(theta) + left_a_step**2
    c = 2.0 * math.pi * scene.drum.f01_Hz / J01
    # Over R^2: what drives a step is added to d before the step keeps R^2 of it.
    drive = c**2 * step_s**2 / modes.norms * np.sin(theta) / theta / left_a_step
    count = max(8, math.ceil(_RADII_A_RADIAN * modes.zeros[-1]))
    radii = (np.arange(count + 3) - 1.0) / count
    # J_m(-x) = (-1)^m J_m(x): the row before r = 0 continues the shape as it is.
    radial = drive * radial_shapes(modes, radii)
    if scene.mallet is not None:
        radial *= left_under_tip(modes, scene.mallet.tip_radius_m / scene.drum.radius_m)
    gains = np.zeros((2, 2 * len(f_Hz)))
    for x, y, pan in scene.listen.pickups:
        angle = (pan + 1.0) * math.pi / 4.0  # equal power
        heard = np.concatenate(shapes_at(modes, x, y))
        gains += np.outer((math.cos(angle), math.sin(angle)), heard)

    def both(values: Numbers) -> npt.NDArray[np.float32]:
        return np.concatenate([values, values]).astype(np.float32)

    size = 2 * len(f_Hz)
    return Bank(
        q=np.zeros(size, np.float32),
        d=np.zeros(size, np.float32),
        kept=both(left_a_step**2),
        bend=both(bend),
        left=gains[0].astype(np.float32),
        right=gains[1].astype(np.float32),
        orders=modes.orders,
        radial=np.ascontiguousarray(radial, np.float32),
        aimed=np.zeros((POOL, size), np.float32),
        turns=np.zeros((2, int(modes.orders.max()) + 1)),
        masses=both(1.0 / drive) if scene.mallet is not None else ABSENT,
    )
