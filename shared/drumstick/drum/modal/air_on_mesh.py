"""The lowest modes of a mesh, moved to where the air has them. Any thread; allocates.

The air's mass on a mode depends on its wavelength, so nothing that a junction does by itself can stand for it. The mesh
is given what the air does to all modes at least, as waves of the speed `_speed`: that of the highest mode which is
moved here (`_HIGHEST`). Of the lower ones each is then slower than on the mesh, and loses more. Per step

    u+ = (that of the mesh without air) + D (S a - l (a - a-)),        a = D' u,  a- = D' u-

where a are the modes' amplitudes, D the dual of their shapes on a few places spread over the head (D' X = 1 for the
shapes X, scaled to X' M X = 1; far fewer places than junctions, spread as densely as the shapes ask for; those inside
have the mass 1).

It is passive with whatever else acts on the head. S is symmetric and only makes the head softer: with K the mesh's
stiffness and C = D' K^-1 D, K - D S D' is positive if S^-1 > C; with S^-1 = C + diag(1/k - 1/q), q that of a mode on
the mesh and q - k in air, that is k < q. What the places give way locally is in C, so it does not put the modes out of
tune. The loss l >= 0 lags by half a step: the work it takes is l (a+ - a-)^2/4, if a l (a - a-)^2/4 that the energy
has less is counted; `taken_room` is what that asks of the step's limit.
"""

import functools
import math
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects.building import MovedModes
from drumstick.drum.membrane.heads import panned
from drumstick.drum.membrane.lattice import J01, MESH_LANES, Lattice, lattice_of
from drumstick.drum.membrane.scheme import Scheme
from drumstick.drum.membrane.step_coefficients import StepCoefficients
from drumstick.drum.modal.air_load import InAir, in_air, load_of
from drumstick.drum.modal.modes import Modes, modes_below, radial_shapes, shapes_at
from drumstick.parameters.drum import Drum
from drumstick.parameters.scene import Scene
from realtime.records import ABSENT

_HIGHEST = 10.2  # zero j of a mode that is moved: 13 of them, and with those of a pair apart 23
_APART = 0.12  # radii between the places: five to the shortest wave
_MOST_TAU = 8.0 / 3.0
_UNEVEN = 1.2  # the densest places, over their mean
_PLACES_A_MODE = 2  # at least
_MODES_AT_ONCE = 4  # of the kernels
_NEPERS = 3.0 * math.log(10.0)  # 60 dB

Numbers = npt.NDArray[np.float64]


class _Solved(NamedTuple):
    # Those of `MovedModes`; and of the shapes against those of `modes`.
    places: npt.NDArray[np.int64]
    dual: npt.NDArray[np.float32]
    stiffness: npt.NDArray[np.float32]
    loss: npt.NDArray[np.float32]
    scale: Numbers
    modes: Modes


def lowest(drum: Drum) -> InAir:
    """The modes that are moved, without their pairs; raises as `in_air`."""
    return in_air(_HIGHEST, drum)


def paired(modes: Modes) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """The moved modes, those of a pair apart: which of `modes` each is, and whether it is that of sin(m phi)."""
    again = np.flatnonzero(modes.orders > 0)
    count = len(modes.orders)
    return np.concatenate([np.arange(count), again]), np.arange(count + len(again)) >= count


def _fitting(modes: Modes, places: int) -> Modes:
    # The lowest of them, as many as so many places tell apart: a coarse mesh has fewer.
    count = len(modes.zeros)
    while count > 1 and _PLACES_A_MODE * (2 * count - np.count_nonzero(modes.orders[:count] == 0)) > places:
        count -= 1
    return Modes(modes.orders[:count], modes.zeros[:count], modes.norms[:count])


def _speed(head: InAir) -> float:
    return float(np.max(2.0 * math.pi * head.f_Hz / head.modes.zeros))


def pitch_on_mesh(drum: Drum) -> float:
    """Pitch of the lowest mode on the mesh before it is moved; f01_Hz without air."""
    return drum.f01_Hz if load_of(drum) is None else _speed(lowest(drum)) * J01 / (2.0 * math.pi)


def taken_room(drum: Drum, step_s: float) -> float:
    """Part of the limit q < 4 that the losses here need: at most 2 l for each place's share of the head."""
    if load_of(drum) is None:
        return 0.0
    theta = 2.0 * math.pi * pitch_on_mesh(drum) * step_s
    spacing = 2.0 * theta / (J01 * math.sqrt(_MOST_TAU))
    densest = (0.5 + max(_APART / spacing, 0.5)) ** 2
    return 4.0 * float(lowest(drum).decays.max()) * step_s * _UNEVEN * densest


def moved_modes(scene: Scene, lattice: Lattice, numbers: StepCoefficients, step_s: float) -> MovedModes:
    """The modes that the air moves on this mesh; absent without air. ValueError where a step is too long for them."""
    if load_of(scene.drum) is None:
        return ABSENT
    found = _found(scene.drum, lattice.spacing, numbers, step_s)
    heard = np.zeros((2, len(found.loss)))
    sources = scene.listen.microphones or scene.listen.pickups
    for (*_, pan), each in zip(sources, moved_by_each(scene, lattice.spacing, numbers, step_s), strict=True):
        heard += np.outer(panned(pan), each)
    return MovedModes(found.places, found.dual, found.stiffness, found.loss, heard)


def moved_by_each(scene: Scene, spacing: float, numbers: StepCoefficients, step_s: float) -> Numbers:
    """By how much each of the scene's pickups hears too much of a moved mode, (pickups, K); microphones: (n, K) zeros.

    (0, 0) without air.
    """
    if load_of(scene.drum) is None:
        return np.zeros((0, 0))
    found = _found(scene.drum, spacing, numbers, step_s)
    if scene.listen.microphones:
        return np.zeros((len(scene.listen.microphones), len(found.loss)))
    each = [_too_much_at(lowest(scene.drum), found, x, y) for x, y, _ in scene.listen.pickups]
    return np.array(each).reshape(len(each), len(found.loss))


def _found(drum: Drum, spacing: float, numbers: StepCoefficients, step_s: float) -> _Solved:
    head = lowest(drum)
    f_Hz, decays = tuple(head.f_Hz.tolist()), tuple(head.decays.tolist())
    return _solved(f_Hz, decays, spacing, numbers, step_s, taken_room(drum, step_s))


def _too_much_at(head: InAir, found: _Solved, x: float, y: float) -> Numbers:
    # By how much a place on the mesh moves more than the head, for each a: all modes of the mesh have one mass, and the
    # shapes that they have without air.
    which, is_sine = paired(found.modes)
    masses = head.masses * (_speed(head) / head.c) ** 2
    pairs = zip(shapes_at(found.modes, x, y), shapes_at(head.basis, x, y), strict=True)
    cosines, sines = (own - (head.mixed(all_of_them) / masses)[: len(own)] for own, all_of_them in pairs)
    moves = np.where(is_sine, sines[which], cosines[which])
    return found.scale * np.pad(moves, (0, len(found.scale) - len(moves)))


@functools.lru_cache(maxsize=4)
def _solved(
    f_Hz: tuple[float, ...],
    decays: tuple[float, ...],
    spacing: float,
    numbers: StepCoefficients,
    step_s: float,
    room: float,
) -> _Solved:
    scheme = numbers.scheme
    lattice = lattice_of(spacing, scheme.topology)
    rows, columns = np.nonzero(lattice.weights)
    mass = 1.0 / (scheme.topology.neighbours * lattice.weights[rows, columns])
    chosen = _spread(lattice, rows, columns, mass)
    modes = _fitting(modes_below(_HIGHEST), int(np.count_nonzero(chosen)))
    which, _ = paired(modes)
    shapes = _shapes(modes, lattice, rows, columns)
    scale = 1.0 / np.sqrt(mass @ shapes**2)
    shapes *= scale
    stiffness = _stiffness(lattice, rows, columns, mass, scheme)
    q = np.sum(shapes * (stiffness @ shapes), axis=0)
    softer, loss = _moved(q, np.array(f_Hz)[which], np.array(decays)[which], numbers, step_s)
    # Places that hardly tell two shapes apart would have to push hard: a coarse mesh has fewer of the modes.
    count, kept = len(modes.zeros), np.ones(len(which), bool)
    while _needed_room(shapes[chosen][:, kept], loss[kept]) > room:
        count -= 1
        if count == 0:
            raise ValueError("the air brakes the lowest mode more than a step can follow")
        kept = which < count
    modes = Modes(modes.orders[:count], modes.zeros[:count], modes.norms[:count])
    shapes, scale, q, softer, loss = shapes[:, kept], scale[kept], q[kept], softer[kept], loss[kept]
    own = shapes[chosen]
    dual = own @ np.linalg.inv(own.T @ own)
    pushed = np.zeros_like(shapes)
    pushed[chosen] = dual
    local = dual.T @ _solve(stiffness, pushed)[chosen] - np.diag(1.0 / q)
    root = np.sqrt(softer)
    inner = np.eye(len(q)) + root[:, None] * local * root
    found = root[:, None] * np.linalg.inv(0.5 * (inner + inner.T)) * root
    # Whole vectors of places, and of modes: what is beyond lies outside the head, and does nothing.
    more, none = -len(dual) % MESH_LANES, -len(q) % _MODES_AT_ONCE
    return _Solved(
        places=np.pad((rows * lattice.weights.shape[1] + columns)[chosen], (0, more)),
        dual=np.ascontiguousarray(np.pad(dual.T, ((0, none), (0, more))), np.float32),
        stiffness=np.pad(found / numbers.loss_divisor, (0, none)).astype(np.float32),
        loss=np.pad(loss, (0, none)).astype(np.float32),
        scale=np.pad(scale, (0, none)),
        modes=modes,
    )


def _needed_room(own: Numbers, loss: Numbers) -> float:
    root = np.sqrt(loss)
    return 2.0 * float(np.linalg.eigvalsh(root[:, None] * np.linalg.inv(own.T @ own) * root).max())


def _moved(
    q: Numbers, f_Hz: Numbers, decays: Numbers, numbers: StepCoefficients, step_s: float
) -> tuple[Numbers, Numbers]:
    # k and l of each mode: from the poles z^2 - b z + c of the mesh to those in air.
    losses, theta = numbers.losses, 2.0 * math.pi * f_Hz * step_s
    if numbers.with_momentum:
        b, c = 1.0 + losses.rho - (1.0 + losses.eta) * q, losses.rho * (1.0 - losses.eta * q)
    else:
        b, c = (2.0 - q) / (1.0 + losses.s), np.full(len(q), (1.0 - losses.s) / (1.0 + losses.s))
    own = np.array([_NEPERS / losses.t60_s(float(each), step_s) for each in theta])
    loss = np.maximum(c - np.exp(-2.0 * (own + decays) * step_s), 0.0)
    softer = (2.0 * np.sqrt(c - loss) * np.cos(theta) - b + loss) * numbers.loss_divisor
    if not np.all(softer < q):
        raise ValueError("the air leaves the lowest modes no stiffness")
    return np.maximum(softer, 0.0), loss


def _shapes(
    modes: Modes, lattice: Lattice, rows: npt.NDArray[np.int64], columns: npt.NDArray[np.int64]
) -> Numbers:
    # Of the moved modes, shape (junctions, N).
    shift = 0.5 * ((rows - lattice.centre_row) & 1) if lattice.topology.shifted else 0.0
    x = (columns - lattice.centre_column + shift) * lattice.spacing
    y = (rows - lattice.centre_row) * lattice.topology.row_height * lattice.spacing
    radii = np.hypot(x, y)
    steps = np.linspace(0.0, 1.0, 400)
    table = radial_shapes(modes, steps)
    which, is_sine = paired(modes)
    radial = np.empty((len(radii), table.shape[1]))
    for number in range(table.shape[1]):
        radial[:, number] = np.interp(radii, steps, table[:, number])
    angle = np.arctan2(y, x)[:, None] * modes.orders[which]
    return radial[:, which] * np.where(is_sine, np.sin(angle), np.cos(angle))


def _spread(
    lattice: Lattice,
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    mass: Numbers,
) -> npt.NDArray[np.bool_]:
    # Every so manieth junction both ways, of those that the rim does not reach.
    every = max(1, round(_APART / lattice.spacing))
    up = rows - lattice.centre_row
    along = columns - lattice.centre_column - ((up >> 1) if lattice.topology.shifted else 0)
    return (up % every == 0) & (along % every == 0) & (np.abs(mass - 1.0) < 1e-12)


def _stiffness(
    lattice: Lattice,
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    mass: Numbers,
    scheme: Scheme,
) -> Any:
    # K, sparse: a step of the head without losses is M (u+ - 2 u + u-) = -K u.
    from scipy import sparse

    build = cast(Any, sparse)
    count = len(rows)
    number = np.full(lattice.weights.shape, -1)
    number[rows, columns] = np.arange(count)
    edges = [(0, 1), (1, 0)]
    beside = [number[rows + up, columns + right] for up, right in edges]
    if lattice.topology.shifted:
        beside.append(number[rows + 1, columns + np.where((rows - lattice.centre_row) % 2 == 1, 1, -1)])
    joined = build.csc_matrix((count, count))
    for other in beside:
        here = np.flatnonzero(other >= 0)
        joined = joined + build.csc_matrix((np.ones(len(here)), (here, other[here])), (count, count))
    laplace = build.diags(mass) - (joined + joined.T) / lattice.topology.neighbours
    stiffness = scheme.tau * laplace
    if scheme.order_4:
        stiffness = stiffness - scheme.order_4 * (laplace @ build.diags(1.0 / mass) @ laplace)
    return stiffness.tocsc()


def _solve(stiffness: Any, pushes: Numbers) -> Numbers:
    from scipy.sparse import linalg

    solver = cast(Any, linalg).splu(stiffness, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    return cast(Numbers, solver.solve(pushes))
