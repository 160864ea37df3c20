"""Sound of each mode at microphones in the air. Any thread; allocates.

A mode that oscillates at w is heard as p = -w^2 q rho/(2 pi) I, with I = int shape exp(-i k (r - r0))/r dA over the
head in an infinite baffle (Rayleigh's integral, as `drumstick.drum.output.microphones` has it for a mesh) and k = w/c0.
r0, the shortest distance from any microphone to the head, is dropped: a delay common to all. The result is the steady
state of each mode; the extra delay of farther parts of the head at the onset, at most the time that sound takes for two
radii, is left out. So microphones cost a bank no delay lines, only a second pair of gains: one acts on a mode's place,
one on its movement.

Measured from the microphone's azimuth the integrand is even in phi, so int cos(m phi) .../r d phi is a cosine series,
for all orders at once; along r it is Gauss-Legendre quadrature. Both are done at evenly spaced k; each mode reads
between the four nearest to its own.
"""

import functools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.air_constants import SOUND_M_PER_S
from drumstick.drum.modal.air_load import Load, load_of, under_load
from drumstick.drum.modal.modes import Modes, bessel, between, radial_shapes
from drumstick.parameters.scene import Scene

_K_STEP = 0.2  # of k times the radius, read between by cubics: 6e-4 of a wave two radii late
_RADII, _ANGLES = 64, 96  # and so many more for each radian, or each order, of the shortest wave

Numbers = npt.NDArray[np.float64]
Waves = npt.NDArray[np.complex128]


def _shortest(microphones: tuple[tuple[float, ...], ...]) -> float:
    # From any microphone to the head, radii.
    return min(math.hypot(max(math.hypot(x, y) - 1.0, 0.0), z) for x, y, z, _ in microphones)


def _integrals(
    aside: float, z: float, shortest: float, shapes: Numbers, radii: Numbers, modes: Modes, k: Numbers
) -> Waves:
    # int shape exp(-i k (r - r0))/r dA of each mode at its own k. shapes: (radii, P), times the weights of
    # the sum over r.
    from scipy import fft

    transforms: Any = fft
    orders = modes.orders
    angles: int = transforms.next_fast_len(int(orders.max()) + _ANGLES, real=True)
    psi = np.arange(angles + 1) * (math.pi / angles)
    way = np.sqrt(radii[:, None] ** 2 + aside**2 - 2.0 * aside * radii[:, None] * np.cos(psi) + z**2)
    waves, turn = math.pi / angles / way + 0.0j, np.exp(-1j * _K_STEP * (way - shortest))
    steps = math.ceil(float(k.max()) / _K_STEP) + 3
    first, weights = between(k / _K_STEP, steps)
    found: Waves = np.zeros(len(k), np.complex128)
    for i in range(steps):
        readers = np.flatnonzero((first <= i) & (i < first + 4))
        series = transforms.dct(waves.astype(np.complex64), type=1, axis=1)[:, orders[readers]]
        weight = weights[i - first[readers], readers]
        found[readers] += weight * np.einsum("rp,rp->p", series, shapes[:, readers])
        waves *= turn
    return found


def heard_by(scene: Scene, highest: float) -> tuple[tuple[Waves, Waves], ...]:
    """Radiation -w^2 I of all modes of cos(m phi), and of sin(m phi), for each of the scene's microphones; read only.

    Shapes (P,), w in units of c0 over the radius. The modes are those of `air_load.in_air`; without a baffle the
    pressure is scaled by the square root of the share of power that is left.
    """
    drum = scene.drum
    return _heard_by(scene.listen.microphones, drum.radius_m, highest, drum.f01_Hz, load_of(drum))


@functools.lru_cache(maxsize=8)  # an engine is built some times over until its level is found
def _heard_by(
    microphones: tuple[tuple[float, ...], ...],
    radius_m: float,
    highest: float,
    f01_Hz: float,
    load: Load | None,
) -> tuple[tuple[Waves, Waves], ...]:
    head = under_load(highest, f01_Hz, load)
    basis = head.basis
    own_k = 2.0 * math.pi * head.f_Hz * radius_m / SOUND_M_PER_S
    nodes, weights = bessel().roots_legendre(_RADII + math.ceil(float(basis.zeros[-1])))
    radii = 0.5 * (nodes + 1.0)
    shapes = head.mixed(radial_shapes(basis, radii)) * (0.5 * weights * radii)[:, None]
    found: list[tuple[Waves, Waves]] = []
    around: dict[tuple[float, float], Waves] = {}  # the same for two that differ by their azimuth alone
    for x, y, z, _ in microphones:
        aside = math.hypot(x, y)
        if (aside, z) not in around:
            read = _integrals(aside, z, _shortest(microphones), shapes, radii, head.modes, own_k)
            around[aside, z] = -(own_k**2) * np.sqrt(head.radiated) * read
        heard = around[aside, z]
        angle = head.modes.orders * math.atan2(y, x)
        found.append((heard * np.cos(angle), heard * np.sin(angle)))
        for values in found[-1]:
            values.setflags(write=False)
    return tuple(found)


def on_place_and_movement(heard: Waves, theta: Numbers) -> tuple[Numbers, Numbers]:
    """Gains by which a mode's place q and its movement in a step, q - q-, sum to what is heard of it.

    With a turn of theta a step q- = cos(theta) q + sin(theta) p, where p is q a quarter of a turn later.
    """
    return heard.real - heard.imag * np.tan(0.5 * theta), heard.imag / np.sin(theta)
