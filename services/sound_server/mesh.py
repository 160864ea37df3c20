"""The triangular waveguide mesh in Kirchhoff variables, with tau = 8/3 (the Courant limit).

    u+ = (tau w sum6(u) + (2 - tau) u - (1 - s) u-) / (1 + s)

w is the junction's weight (1/6 inside, less at the rim, 0 outside). tau = 8/3 has a third of the phase error of the
textbook lossless mesh (tau = 2) and is nearly isotropic. The losses are those of a membrane in air that brakes every
mode alike: the product of the two roots of a mode is (1 - s)/(1 + s), whatever its frequency: the decay is exact.
"""

import math

import numpy as np
import numpy.typing as npt

from realtime.jit import njit

TAU = 8.0 / 3.0
Floats = npt.NDArray[np.float32]


def loss(t60_s: float, mesh_rate_Hz: float) -> float:
    """s of the equation above, for an amplitude that falls by 60 dB in t60_s. 0 for an infinite one."""
    squared = 10.0 ** (-6.0 / (t60_s * mesh_rate_Hz)) if math.isfinite(t60_s) else 1.0
    return (1.0 - squared) / (1.0 + squared)


@njit(fastmath={"contract"})
def sweep(
    now: Floats,
    then: Floats,
    weights: Floats,
    spans: npt.NDArray[np.int32],
    centre_row: int,
    now_gain: np.float32,
    then_gain: np.float32,
) -> None:
    """One time step: `then` holds u- and receives u+. Any thread; no allocation.

    All flat, shape (rows * stride,); `weights` are tau w/(1 + s), now_gain is (2 - tau)/(1 + s), then_gain
    (1 - s)/(1 + s). Junctions outside have weight 0 and stay exactly 0. The slices start at 0 so that the compiler can
    prove the indices positive, without which the loop would not become vector code.
    """
    stride = weights.shape[0] // spans.shape[0]
    for row in range(1, spans.shape[0] - 1):
        start = row * stride + spans[row, 0]
        n = spans[row, 1]
        shift = (row - centre_row) & 1
        along = now[start - 1 : start + n + 1]
        above = now[start - stride - 1 + shift : start - stride + n + shift]
        below = now[start + stride - 1 + shift : start + stride + n + shift]
        w = weights[start : start + n]
        u = then[start : start + n]
        for i in range(n):
            ring = (along[i] + along[i + 2]) + (above[i] + above[i + 1]) + (below[i] + below[i + 1])
            u[i] = w[i] * ring + now_gain * along[i + 1] - then_gain * u[i]


@njit()
def largest(plane: Floats) -> float:
    """max |u|. Any thread; no allocation."""
    top = np.float32(0.0)
    for i in range(plane.shape[0]):
        top = max(top, abs(plane[i]))
    return float(top)
