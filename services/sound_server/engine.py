"""Everything that sounds, laid out for compiled code: one scene at one device rate.

An Engine belongs to whoever renders it: one thread at a time. Other threads push strikes into its ring and read
`meters`. It is a named tuple of arrays because compiled code takes those apart at no cost, and because a C callback
can put it together again from a table of addresses (see sinks.callback).
"""

import math
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt

from drumstick.scene import Scene
from realtime.jit import Record, Records
from sound_server import mesh
from sound_server.events import EVENT, StrikeRing
from sound_server.excitation import POOL, PULSE
from sound_server.lattice import LAMBDA, Lattice, lattice_of, spacing_for, surrounding
from sound_server.upsample import TAPS, interpolator

PENDING = 256
_DIVISOR = {"draft": 4, "standard": 3, "fine": 2}
_FEWEST_ACROSS = 24.0  # below this the pitch of the higher modes is off by more than 7 cents
_LARGEST_DIVISOR = 12
# Junction updates a second that one thread may spend on the mesh: 0.5 - 0.7 ns each were measured, so about 40 %.
_MOST_UPDATES_PER_S = 6.5e8

# What changes while it plays, and the scalars that the kernels need.
CONTROL: np.dtype[Any] = np.dtype(
    [
        ("rate_Hz", "f8"),
        ("divisor", "i8"),
        ("spacing", "f8"),
        ("centre_row", "i8"),
        ("centre_column", "i8"),
        ("now_gain", "f4"),
        ("then_gain", "f4"),
        ("force_gain", "f8"),
        ("output_gain", "f8"),
        ("phase", "i8"),  # device samples since the last step of the mesh
        ("plane", "i8"),  # which of the two planes is the present
        ("head", "i8"),  # newest sample of the interpolator's history
        ("begun", "i8"),  # pulses begun so far
        ("pending", "i8"),  # strikes that wait for their instant
        ("steps", "i8"),
        ("asleep", "i8"),  # 1 while the head is at rest and is not computed
        ("loudest", "f8"),  # largest |u| seen since it woke
    ],
    align=True,
)
# Written by the rendering thread, read by any: peaks fall back by themselves, so nobody needs to reset them.
METERS: np.dtype[Any] = np.dtype(
    [("peak_left", "f8"), ("peak_right", "f8"), ("frames", "i8"), ("begun", "i8")], align=True
)


class Engine(NamedTuple):
    """One drum. Shapes, with J = rows * stride and P pickups: planes (2, J), weights (J,), spans (rows, 2),
    pulses (32,), ears (3 P,) and their gains (3 P, 2), phases (divisor, TAPS), history (2, 2 TAPS), pending (256,),
    ring cells (24,) and slots (256,).
    """

    control: Records
    meters: Records
    planes: npt.NDArray[np.float32]
    weights: npt.NDArray[np.float32]
    spans: npt.NDArray[np.int32]
    pulses: Records
    ears: npt.NDArray[np.int64]
    ear_gains: npt.NDArray[np.float32]
    phases: npt.NDArray[np.float32]
    history: npt.NDArray[np.float32]
    pending: Records
    ring_cells: npt.NDArray[np.int64]
    ring_slots: Records


def divisor_for(scene: Scene, rate_Hz: int) -> int:
    """Device samples per step of the mesh: what the scene's accuracy asks for, within two limits.

    A high drum would have too few junctions across to be in tune (it gets a faster mesh, which is cheap there); a
    very low one would need more than one thread can compute (it gets a slower mesh, and loses overtones at the top).
    """
    divisor = _DIVISOR[scene.mesh.accuracy]
    while divisor > 1 and 2.0 / spacing_for(scene.drum.f01_Hz, rate_Hz / divisor) < _FEWEST_ACROSS:
        divisor -= 1
    while divisor < _LARGEST_DIVISOR and _updates_per_s(scene, rate_Hz, divisor) > _MOST_UPDATES_PER_S:
        divisor += 1
    return divisor


def _updates_per_s(scene: Scene, rate_Hz: int, divisor: int) -> float:
    spacing = spacing_for(scene.drum.f01_Hz, rate_Hz / divisor)
    return math.pi / (math.sqrt(3.0) / 2.0 * spacing * spacing) * rate_Hz / divisor


def aligned(shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """Zeros that begin on a 64-byte boundary."""
    count = math.prod(shape)
    room = np.zeros(count + 16, np.float32)
    skip = (-room.ctypes.data) % 64 // 4
    return room[skip : skip + count].reshape(shape)


def _ears(scene: Scene, lattice: Lattice) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    places: list[int] = []
    gains: list[tuple[float, float]] = []
    for x, y, pan in scene.listen.pickups:
        angle = (pan + 1.0) * math.pi / 4.0  # equal power
        for place, share in surrounding(lattice, x, y):
            places.append(place)
            gains.append((share * math.cos(angle), share * math.sin(angle)))
    return np.array(places, np.int64), np.array(gains, np.float32)


def _control(scene: Scene, rate_Hz: int, divisor: int, lattice: Lattice) -> Records:
    s = mesh.loss(scene.drum.t60_s, rate_Hz / divisor)
    control: Records = np.zeros(1, CONTROL)
    fields: Record = control[0]
    fields["rate_Hz"] = rate_Hz
    fields["divisor"] = divisor
    fields["spacing"] = lattice.spacing
    fields["centre_row"] = lattice.centre_row
    fields["centre_column"] = lattice.centre_column
    fields["now_gain"] = (2.0 - mesh.TAU) / (1.0 + s)
    fields["then_gain"] = (1.0 - s) / (1.0 + s)
    # u'' = c^2 (laplace u + F delta / tension): a step adds lambda^2 F / (area of a junction / h^2), that is
    # tau w sqrt(3) F with w = 1/6, whatever the spacing. The tension is 1; the level is calibrated.
    fields["force_gain"] = 6.0 * LAMBDA**2 * 2.0 / math.sqrt(3.0) / mesh.TAU
    fields["output_gain"] = 1.0
    fields["asleep"] = 1
    return control


def new_engine(scene: Scene, rate_Hz: int, strikes: StrikeRing) -> Engine:
    """An engine at rest with output gain 1; `calibrate.build` gives a calibrated one. Allocates; any thread."""
    divisor = divisor_for(scene, rate_Hz)
    lattice = lattice_of(spacing_for(scene.drum.f01_Hz, rate_Hz / divisor))
    control = _control(scene, rate_Hz, divisor, lattice)
    size = lattice.weights.size
    weights = aligned((size,))
    weights[:] = (mesh.TAU / (1.0 + mesh.loss(scene.drum.t60_s, rate_Hz / divisor)) * lattice.weights).ravel()
    ears, ear_gains = _ears(scene, lattice)
    return Engine(
        control=control,
        meters=cast(Records, np.zeros(1, METERS)),
        planes=aligned((2, size)),
        weights=weights,
        spans=lattice.spans,
        pulses=cast(Records, np.zeros(POOL, PULSE)),
        ears=ears,
        ear_gains=ear_gains,
        phases=interpolator(divisor),
        history=aligned((2, 2 * TAPS)),
        pending=cast(Records, np.zeros(PENDING, EVENT)),
        ring_cells=strikes.cells,
        ring_slots=strikes.slots,
    )


def words(engine: Engine) -> str:
    """The mesh in a few words, for the log."""
    control: Record = engine.control[0]
    rate = control["rate_Hz"] / control["divisor"]
    junctions = np.count_nonzero(engine.weights)
    return f"mesh of {2.0 / control['spacing']:.1f} junctions across ({junctions}) at {rate:g} Hz"
