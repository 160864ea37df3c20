"""The mesh's step as one would first write it, in float64: what the kernels that play are compared with. Any thread."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.membrane.lattice import Lattice
from drumstick.drum.membrane.scheme import Losses, Scheme
from realtime.kernels.jit import njit

Plane = npt.NDArray[np.float64]


class PlainMesh(NamedTuple):
    """Shapes, with J junctions stored: planes (2, J), u- and u by turns; laplacian (J,), for fourth order; weights (J,);
    spans (rows, 2), first and last column + 1. Gains: of the neighbours' mean, of u, of u-, and by fourth order of
    A u."""

    planes: Plane
    laplacian: Plane
    weights: Plane
    spans: npt.NDArray[np.int64]
    stride: int
    odd: int  # the parity of shifted rows; -1 on a square mesh
    ring_gain: float
    now_gain: float
    then_gain: float
    laplacian_gain: float


@njit(fastmath={"contract"})
def _swept(
    mesh: PlainMesh, now: Plane, then: Plane, ring_gain: float, now_gain: float, then_gain: float
) -> None:
    # Unsigned indices need no look whether they are negative, and the loops become vectors.
    stride, spans, weights, odd = mesh.stride, mesh.spans, mesh.weights, mesh.odd
    one = np.uint64(1)
    for row in range(spans.shape[0]):
        first, last = np.uint64(row * stride + spans[row, 0]), np.uint64(row * stride + spans[row, 1])
        if odd < 0:
            beside = np.uint64(stride)
            for k in range(first, last):
                ring = now[k - one] + now[k + one] + now[k - beside] + now[k + beside]
                then[k] = ring_gain * weights[k] * ring + now_gain * now[k] + then_gain * then[k]
        else:
            shift = 0 if (row & 1) == odd else 1
            up, down = np.uint64(stride + shift), np.uint64(stride - shift)
            for k in range(first, last):
                ring = now[k - one] + now[k + one] + now[k - up] + now[k - up + one]
                ring += now[k + down] + now[k + down + one]
                then[k] = ring_gain * weights[k] * ring + now_gain * now[k] + then_gain * then[k]


@njit(fastmath={"contract"})
def _add(then: Plane, gain: float, now: Plane) -> None:
    for k in range(then.shape[0]):
        then[k] += gain * now[k]


@njit()
def plain_steps(mesh: PlainMesh, at: int, steps: int) -> None:
    """So many steps, from plane `at` as u on. No allocation."""
    for _ in range(steps):
        now, then = mesh.planes[at], mesh.planes[1 - at]
        if mesh.laplacian_gain == 0.0:
            _swept(mesh, now, then, mesh.ring_gain, mesh.now_gain, mesh.then_gain)
        else:
            _swept(mesh, now, mesh.laplacian, 1.0, -1.0, 0.0)
            _swept(mesh, mesh.laplacian, then, mesh.ring_gain, mesh.laplacian_gain, mesh.then_gain)
            _add(then, mesh.now_gain, now)
        at = 1 - at


def plain_mesh(lattice: Lattice, scheme: Scheme, losses: Losses) -> PlainMesh:
    """Plain mesh at rest, with even losses: the gains of drumstick.drum.membrane.scheme's step."""
    held_back = 1.0 + losses.s
    spans = np.zeros(lattice.spans.shape, np.int64)
    for row, weights in enumerate(lattice.weights):
        inside = np.flatnonzero(weights)
        if len(inside):
            spans[row] = inside[0], inside[-1] + 1
    fourth = scheme.order_4 != 0.0
    return PlainMesh(
        planes=np.zeros((2, lattice.weights.size)),
        laplacian=np.zeros(lattice.weights.size),
        weights=lattice.weights.ravel(),
        spans=spans,
        stride=lattice.weights.shape[1],
        odd=(lattice.centre_row + 1) & 1 if lattice.topology.shifted else -1,
        ring_gain=(scheme.order_4 if fourth else scheme.tau) / held_back,
        now_gain=(2.0 if fourth else 2.0 - scheme.tau) / held_back,
        then_gain=-(1.0 - losses.s) / held_back,
        laplacian_gain=(scheme.tau - scheme.order_4) / held_back if fourth else 0.0,
    )
