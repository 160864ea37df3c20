"""The mesh's step as one would first write it, in float64: what the kernels that play are compared with. Any thread."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import Lattice
from drumstick.drum.membrane.scheme import Losses, Scheme
from realtime.kernels.jit import njit

Doubles = npt.NDArray[np.float64]


class PlainMesh(NamedTuple):
    """Shapes, with J junctions stored: time_levels (2, J), u- and u by turns; laplacian (J,), for fourth order; weights (J,);
    spans (rows, 2), first and last column + 1. Gains: of the neighbours' mean, of u, of u-, and by fourth order of
    A u."""

    time_levels: Doubles
    laplacian: Doubles
    weights: Doubles
    spans: npt.NDArray[np.int64]
    stride: int
    odd: int  # the parity of shifted rows; -1 on a square mesh
    neighbour_gain: float
    u_gain: float
    u_old_gain: float
    laplacian_gain: float


@njit(fastmath={"contract"})
def _swept(
    mesh: PlainMesh, u: Doubles, u_old: Doubles, neighbour_gain: float, u_gain: float, u_old_gain: float
) -> None:
    # Unsigned indices need no look whether they are negative, and the loops become vectors.
    stride, spans, weights, odd = mesh.stride, mesh.spans, mesh.weights, mesh.odd
    one = np.uint64(1)
    for row in range(spans.shape[0]):
        first, last = np.uint64(row * stride + spans[row, 0]), np.uint64(row * stride + spans[row, 1])
        if odd < 0:
            beside = np.uint64(stride)
            for k in range(first, last):
                neighbour_sum = u[k - one] + u[k + one] + u[k - beside] + u[k + beside]
                u_old[k] = neighbour_gain * weights[k] * neighbour_sum + u_gain * u[k] + u_old_gain * u_old[k]
        else:
            shift = 0 if (row & 1) == odd else 1
            up, down = np.uint64(stride + shift), np.uint64(stride - shift)
            for k in range(first, last):
                neighbour_sum = u[k - one] + u[k + one] + u[k - up] + u[k - up + one]
                neighbour_sum += u[k + down] + u[k + down + one]
                u_old[k] = neighbour_gain * weights[k] * neighbour_sum + u_gain * u[k] + u_old_gain * u_old[k]


@njit(fastmath={"contract"})
def _add(u_old: Doubles, gain: float, u: Doubles) -> None:
    for k in range(u_old.shape[0]):
        u_old[k] += gain * u[k]


@njit()
def plain_steps(mesh: PlainMesh, at: int, steps: int) -> None:
    """So many steps, from time level `at` as u on. No allocation."""
    for _ in range(steps):
        u, u_old = mesh.time_levels[at], mesh.time_levels[1 - at]
        if mesh.laplacian_gain == 0.0:
            _swept(mesh, u, u_old, mesh.neighbour_gain, mesh.u_gain, mesh.u_old_gain)
        else:
            _swept(mesh, u, mesh.laplacian, 1.0, -1.0, 0.0)
            _swept(mesh, mesh.laplacian, u_old, mesh.neighbour_gain, mesh.laplacian_gain, mesh.u_old_gain)
            _add(u_old, mesh.u_gain, u)
        at = 1 - at


def plain_mesh(lattice: Lattice, scheme: Scheme, losses: Losses) -> PlainMesh:
    """Plain mesh at rest, with even losses: the gains of drumstick.drum.membrane.scheme's step."""
    loss_divisor = 1.0 + losses.s
    spans = np.zeros(lattice.spans.shape, np.int64)
    for row, weights in enumerate(lattice.weights):
        inside = np.flatnonzero(weights)
        if len(inside):
            spans[row] = inside[0], inside[-1] + 1
    fourth = scheme.order_4 != 0.0
    return PlainMesh(
        time_levels=np.zeros((2, lattice.weights.size)),
        laplacian=np.zeros(lattice.weights.size),
        weights=lattice.weights.ravel(),
        spans=spans,
        stride=lattice.weights.shape[1],
        odd=(lattice.centre_row + 1) & 1 if lattice.topology.shifted else -1,
        neighbour_gain=(scheme.order_4 if fourth else scheme.tau) / loss_divisor,
        u_gain=(2.0 if fourth else 2.0 - scheme.tau) / loss_divisor,
        u_old_gain=-(1.0 - losses.s) / loss_divisor,
        laplacian_gain=(scheme.tau - scheme.order_4) / loss_divisor if fourth else 0.0,
    )
