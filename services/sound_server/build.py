"""From a scene to an engine at rest: which mesh, which losses, which effects. Allocates; any thread."""

import math
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from drumstick.drum import Drum
from drumstick.drum_effects import Cavity as CavityTable
from drumstick.scene import Scene
from realtime.jit import Record, Records
from sound_server.effects import cavity, rim, snare, tension
from sound_server.effects.cavity import Cavity
from sound_server.effects.internal_loss import Momentum
from sound_server.effects.muffle import Muffle
from sound_server.effects.rim import Rim
from sound_server.effects.snare import Snare
from sound_server.effects.tension import Tension
from sound_server.engine import CONTROL, METERS, PENDING, Engine
from sound_server.events import EVENT, StrikeRing
from sound_server.excitation import FORCES, POOL, PULSE
from sound_server.membrane.lattice import J01, TOPOLOGIES, Lattice
from sound_server.membrane.places import corners_of
from sound_server.membrane.scheme import Losses, Scheme, even_losses, rising_losses, scheme_of, tuned
from sound_server.membrane.sweep import SQUARE, TRIANGULAR, Head
from sound_server.push import FORCE
from sound_server.stream.timeline import stream_of
from sound_server.upsample import TAPS, interpolator

_DIVISOR = {"draft": 4, "standard": 3, "fine": 2}
_FEWEST_ACROSS = 24.0  # below this the pitch of the higher modes is off by more than 8 cents
_LARGEST_DIVISOR = 12
# Junction updates a second that one thread may spend on the mesh: 0.25 to 0.3 ns each were measured, so about 40 %.
_MOST_UPDATES_PER_S = 1.6e9
# A glide goes at most to so many times what a stroke of full scale makes of it on the mean; the mesh has room for it.
GLIDE_ROOM = 2.0
# Where wires lie on the second head, in radii, and the beads that each of them is.
_WIRE_LENGTH, _BED_WIDTH, _BEADS = 0.85, 0.12, 5
_HIGHEST = 0.4  # of the mesh's rate: where modes of the rim end
# Effects that the second sweep of the fourth order does not know.
_SECOND_ORDER_ONLY = ("internal_loss", "tension", "cavity")


def aligned(shape: tuple[int, ...]) -> npt.NDArray[np.float32]:
    """Zeros that begin on a 64-byte boundary."""
    count = math.prod(shape)
    room = np.zeros(count + 16, np.float32)
    skip = (-room.ctypes.data) % 64 // 4
    return room[skip : skip + count].reshape(shape)


def order_of(scene: Scene) -> int:
    """Of the scheme in space and time: 4 for `fine`, where the drum's effects allow it."""
    fourth = scene.mesh.accuracy == "fine" and scene.mesh.topology == "triangular"
    return 4 if fourth and not any(name in scene.drum.effects for name in _SECOND_ORDER_ONLY) else 2


def _across(scene: Scene, mesh_rate_Hz: float) -> float:
    scheme = _scheme(scene)
    return J01 / math.pi * math.sqrt(scheme.tau) / 2.0 * mesh_rate_Hz / scene.drum.f01_Hz


def _scheme(scene: Scene) -> Scheme:
    topology = TOPOLOGIES[scene.mesh.topology]
    return scheme_of(topology, order_of(scene), scene.mesh.courant == "lossless" and topology.shifted)


def _updates_per_s(scene: Scene, rate_Hz: int, divisor: int) -> float:
    junctions = (
        math.pi / 4.0 * _across(scene, rate_Hz / divisor) ** 2 / TOPOLOGIES[scene.mesh.topology].row_height
    )
    return junctions * rate_Hz / divisor * (2.0 if order_of(scene) == 4 else 1.0)


def divisor_for(scene: Scene, rate_Hz: int) -> int:
    """Device samples per step of the mesh: what the scene's accuracy asks for, within two limits.

    A high drum would have too few junctions across to be in tune (it gets a faster mesh, which is cheap there); a
    very low one would need more than one thread can compute (it gets a slower mesh, and loses overtones at the top).
    """
    divisor = _DIVISOR[scene.mesh.accuracy]
    fewest = _FEWEST_ACROSS
    if scene.mesh.junctions_across > 0.0:
        divisor, fewest = _LARGEST_DIVISOR, scene.mesh.junctions_across
    while divisor > 1 and _across(scene, rate_Hz / divisor) < fewest:
        divisor -= 1
    while divisor < _LARGEST_DIVISOR and _updates_per_s(scene, rate_Hz, divisor) > _MOST_UPDATES_PER_S:
        divisor += 1
    return divisor


def _losses(drum: Drum, step_s: float) -> Losses:
    t60_s = drum.t60_s
    if "air_loss" in drum.effects:
        t60_s = 1.0 / (1.0 / t60_s + 1.0 / drum.effects["air_loss"].t60_s)
    if "internal_loss" not in drum.effects:
        return even_losses(t60_s, step_s)
    high = drum.effects["internal_loss"]
    return rising_losses(t60_s, drum.f01_Hz, min(high.t60_s, 0.999 * t60_s), high.at_Hz, step_s)


def _air_spring(table: CavityTable, step_s: float) -> float:
    # K T^2: see effects.cavity.
    stiffness = cavity.AIR_KG_PER_M3 * cavity.SOUND_M_PER_S**2
    return stiffness / (table.head_kg_per_m2 * table.depth_m) * step_s**2


def head_of(lattice: Lattice, baked: float) -> Head:
    """A head at rest on this lattice; `baked` is what its weights are multiplied with."""
    size = lattice.weights.size
    weights = aligned((size,))
    weights[:] = (baked * lattice.weights).ravel()
    grid: Any = np.zeros(1, TRIANGULAR if lattice.topology.shifted else SQUARE)
    grid["spacing"], grid["stride"] = lattice.spacing, lattice.weights.shape[1]
    grid["centre_row"], grid["centre_column"] = lattice.centre_row, lattice.centre_column
    return Head(_planes(size), weights, lattice.spans, grid)


def _planes(size: int) -> npt.NDArray[np.float32]:
    # Each plane begins on a boundary of its own, and a vector before and behind it belongs to the array.
    return aligned((2, size))


def _ears(scene: Scene, head: Head, level: float) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float32]]:
    places: list[int] = []
    gains: list[tuple[float, float]] = []
    for x, y, pan in scene.listen.pickups:
        angle = (pan + 1.0) * math.pi / 4.0  # equal power
        for place, share in zip(*corners_of(head, x, y), strict=True):
            places.append(place)
            gains.append((level * share * math.cos(angle), level * share * math.sin(angle)))
    return np.array(places, np.int64), np.array(gains, np.float32)


class _Numbers:
    # What the first head's step is made of: its scheme, its losses, and what is baked into the weights.
    def __init__(self, scene: Scene, step_s: float) -> None:
        drum = scene.drum
        self.losses = _losses(drum, step_s)
        self.spring = _air_spring(drum.effects["cavity"], step_s) if "cavity" in drum.effects else 0.0
        # The air spring adds at most 2 K T^2 to q, the losses take from what is stable.
        room = (4.0 - 2.0 * self.spring) / 4.0 * self.losses.most
        self.glide = 0.0
        if "tension" in drum.effects:
            self.glide = GLIDE_ROOM * (2.0 ** (drum.effects["tension"].glide_cents / 600.0) - 1.0)
        self.scheme = _scheme(scene).squeezed(room / (1.0 + 1.1 * self.glide))
        self.with_momentum = self.losses.eta > 0.0
        self.held_back = 1.0 if self.with_momentum else 1.0 + self.losses.s
        self.baked = 1.0 if self.scheme.order_4 else self.scheme.tau / self.held_back

    def control(self, scene: Scene, rate_Hz: int, divisor: int) -> Records:
        scheme, s = self.scheme, self.losses.s
        control: Records = np.zeros(1, CONTROL)
        fields: Record = control[0]
        fields["rate_Hz"], fields["divisor"] = rate_Hz, divisor
        fields["tau"], fields["held_back"] = scheme.tau, self.held_back
        fields["own_gain"] = self.baked
        fields["now_gain"] = (2.0 - scheme.tau) / self.held_back
        fields["then_gain"] = (1.0 - s) / self.held_back
        if scheme.order_4:
            fields["now_gain"] = 2.0 / self.held_back
            fields["order_4"] = scheme.order_4 / self.held_back
            fields["order_2"] = (scheme.tau - scheme.order_4) / self.held_back
        elif self.with_momentum:
            fields["now_gain"] = scheme.tau
        # u'' = c^2 (laplace u + F delta / tension): a step adds (c T/h)^2 F / (a junction's area / h^2) where the
        # weight is 1 / neighbours. The tension is 1; the level is calibrated.
        neighbours, height = scheme.topology.neighbours, scheme.topology.row_height
        fields["force_gain"] = neighbours * scheme.tau / 4.0 / height / (self.baked * self.held_back)
        fields["spread"] = scene.drum.inject == "linear"
        fields["output_gain"] = 1.0
        fields["asleep"] = 1
        return control


def _muffle(scene: Scene, lattice: Lattice, losses: Losses, step_s: float) -> Muffle:
    table = scene.drum.effects["muffle"]
    s = even_losses(table.t60_s, step_s).s
    rows, columns = np.nonzero(lattice.weights)
    at = np.array([lattice.position(int(r), int(c)) for r, c in zip(rows, columns, strict=True)])
    under = np.zeros(len(at), bool)
    for x, y, radius in table.patches:
        under |= np.hypot(at[:, 0] - x, at[:, 1] - y) <= abs(radius)
    places = (rows * lattice.weights.shape[1] + columns)[under].astype(np.int64)
    shares = np.full(len(places), s / (1.0 + losses.s + s), np.float32)
    return Muffle(places, shares, np.zeros(len(places), np.float32))


def _tension(lattice: Lattice, numbers: _Numbers, muffled: Muffle | None) -> Tension:
    # `calibrate` finds `half`; until then the head is far too slack to stiffen.
    state: Records = np.zeros(1, tension.STATE)
    fields: Record = state[0]
    fields["q_most"], fields["half"] = numbers.glide * numbers.scheme.tau, 1e300
    fields["tau"], fields["baked"] = numbers.scheme.tau, numbers.baked
    fields["held_back"], fields["eta"] = numbers.held_back, numbers.losses.eta
    share = aligned((lattice.weights.size,))
    inside = np.flatnonzero(lattice.weights)
    share[inside] = 1.0 / (lattice.topology.neighbours * lattice.weights.ravel()[inside])
    if muffled is not None:
        share[muffled.places] *= 1.0 - muffled.shares
    return Tension(state, share)


def _cavity(scene: Scene, lattice: Lattice, numbers: _Numbers, step_s: float) -> Cavity:
    table = scene.drum.effects["cavity"]
    losses = even_losses(table.t60_s, step_s)
    scheme = scheme_of(lattice.topology, 2, False).squeezed(4.0 - 2.0 * numbers.spring)
    second = tuned(table.f01_Hz, step_s, scheme, losses)
    head = head_of(second, scheme.tau / (1.0 + losses.s))
    state: Records = np.zeros(1, cavity.STATE)
    fields: Record = state[0]
    fields["per_area_1"], fields["per_area_2"] = 1.0 / lattice.area, 1.0 / second.area
    # A push f moves a junction of weight 1 / neighbours by f times what is baked into the weights, over the neighbours.
    fields["push_1"] = numbers.spring * lattice.topology.neighbours / (numbers.baked * numbers.held_back)
    fields["push_2"] = numbers.spring * lattice.topology.neighbours / scheme.tau
    fields["now_gain"] = (2.0 - scheme.tau) / (1.0 + losses.s)
    fields["then_gain"] = (1.0 - losses.s) / (1.0 + losses.s)
    return Cavity(head, state, *_ears(scene, head, table.heard))


def _snare(scene: Scene, under: Cavity, step_s: float) -> Snare:
    # The wires lie along x, side by side about the middle. `calibrate` presses them on.
    table = scene.drum.effects["snare"]
    wires: int = table.wires
    state: Records = np.zeros(1, snare.STATE)
    fields: Record = state[0]
    held_back = 2.0 / (1.0 + float(under.state["then_gain"][0]))
    tau = 2.0 - float(under.state["now_gain"][0]) * held_back
    neighbours = TOPOLOGIES[scene.mesh.topology].neighbours
    junctions = 1.0 / float(under.state["per_area_2"][0])
    along = np.linspace(-_WIRE_LENGTH, _WIRE_LENGTH, _BEADS)
    across = np.linspace(-_BED_WIDTH, _BED_WIDTH, wires) if wires > 1 else np.zeros(1)
    places = [corners_of(under.head, float(x), float(y)) for y in across for x in along]
    # One bead a junction: two on the same would each be solved for without the other.
    under_beads = np.unique([corners[int(np.argmax(shares))] for corners, shares in places])
    beads: Records = np.zeros(len(under_beads), snare.BEAD)
    beads["junction"] = under_beads
    fields["mass"] = table.mass * junctions / len(beads)
    fields["spring"] = min((2.0 * math.pi * table.f_Hz * step_s) ** 2, 2.0)
    fields["loss"] = 1.0 + even_losses(table.t60_s, step_s).s
    fields["give"] = neighbours / tau
    # As stiff as a step still shows: a bead and a junction in touch swing at a radian a step.
    fields["stiffness"] = 1.0 / (1.0 + 1.0 / fields["mass"])
    return Snare(beads, state)


def _rim(scene: Scene, step_s: float) -> Rim:
    # Modes beyond the mesh's reach are left out; each rings as many periods as the lowest, and is struck the weaker the
    # higher it is.
    table = scene.drum.effects["rim"]
    ratios = [ratio for ratio in rim.RATIOS if ratio * table.f_Hz * step_s < _HIGHEST]
    modes: Records = np.zeros(max(len(ratios), 1), rim.MODE)
    for mode, ratio in zip(modes, ratios, strict=False):
        left = 10.0 ** (-3.0 * step_s * ratio / table.t60_s)
        mode["turn"] = 2.0 * left * math.cos(2.0 * math.pi * ratio * table.f_Hz * step_s)
        mode["kept"] = left * left
        mode["drive"] = 0.5 / ratio / sum(1.0 / other for other in ratios)
    state: Records = np.zeros(1, rim.STATE)
    state["width"] = table.width
    return Rim(modes, state)


def new_engine(scene: Scene, rate_Hz: int, strikes: StrikeRing) -> Engine:
    """An engine at rest with output gain 1 and no pitch glide yet; `calibrate.build` gives a calibrated one."""
    divisor = divisor_for(scene, rate_Hz)
    step_s = divisor / rate_Hz
    numbers = _Numbers(scene, step_s)
    lattice = tuned(scene.drum.f01_Hz, step_s, numbers.scheme, numbers.losses)
    head = head_of(lattice, numbers.baked)
    effects = scene.drum.effects
    second = _cavity(scene, lattice, numbers, step_s) if "cavity" in effects else None
    muffled = _muffle(scene, lattice, numbers.losses, step_s) if "muffle" in effects else None
    rho_and_eta = np.array([numbers.losses.rho, numbers.losses.eta], np.float32)
    size = lattice.weights.size
    ears, ear_gains = _ears(scene, head, 1.0)
    return Engine(
        control=numbers.control(scene, rate_Hz, divisor),
        meters=cast(Records, np.zeros(1, METERS)),
        head=head,
        pulses=cast(Records, np.zeros(POOL, PULSE)),
        forces=cast(Records, np.zeros(FORCES, FORCE)),
        ears=ears,
        ear_gains=ear_gains,
        phases=interpolator(divisor),
        history=aligned((2, 2 * TAPS)),
        pending=cast(Records, np.zeros(PENDING, EVENT)),
        ring_cells=strikes.cells,
        ring_slots=strikes.slots,
        bend=aligned((size,)) if numbers.scheme.order_4 else None,
        internal_loss=Momentum(aligned((size,)), rho_and_eta) if numbers.with_momentum else None,
        muffle=muffled,
        tension=_tension(lattice, numbers, muffled) if "tension" in effects else None,
        cavity=second,
        snare=_snare(scene, second, step_s) if second is not None and "snare" in effects else None,
        rim=_rim(scene, step_s) if "rim" in effects else None,
        stream=stream_of(scene, step_s) if scene.drum.excitation == "streamed" else None,
    )


def words(engine: Engine) -> str:
    """The mesh in a few words, for the log."""
    control: Record = engine.control[0]
    rate = control["rate_Hz"] / control["divisor"]
    junctions = np.count_nonzero(engine.head.weights)
    across = 2.0 / engine.head.grid["spacing"][0]
    return f"mesh of {across:.1f} junctions across ({junctions}) at {rate:g} Hz"
