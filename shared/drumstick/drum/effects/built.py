"""The effects that a scene names, laid out for the kernels. Allocates; any thread."""

import math

import numpy as np

from drumstick.drum.effects import cavity, rim, snare, tension
from drumstick.drum.effects.cavity import Cavity
from drumstick.drum.effects.muffle import Muffle
from drumstick.drum.effects.rim import Rim
from drumstick.drum.effects.snare import Snare
from drumstick.drum.effects.tension import Tension
from drumstick.drum.membrane.heads import aligned, ears_on, head_of
from drumstick.drum.membrane.lattice import TOPOLOGIES, Lattice
from drumstick.drum.membrane.places import corners_of
from drumstick.drum.membrane.scheme import Losses, even_losses, scheme_of, tuned
from drumstick.drum.step_numbers import Numbers
from drumstick.parameters.scene import Scene
from realtime.records import Record, Records

# Where wires lie on the second head, in radii, and the beads that each of them is.
_WIRE_LENGTH, _BED_WIDTH, _BEADS = 0.85, 0.12, 5
_HIGHEST = 0.4  # of the mesh's rate: where modes of the rim end


def muffle_of(scene: Scene, lattice: Lattice, losses: Losses, step_s: float) -> Muffle:
    """The junctions under the scene's patches."""
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


def tension_of(lattice: Lattice, numbers: Numbers, muffled: Muffle | None) -> Tension:
    """`calibrate` finds `half`; until then the head is far too slack to stiffen."""
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


def cavity_of(scene: Scene, lattice: Lattice, numbers: Numbers, step_s: float) -> Cavity:
    """The second head, and the air between."""
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
    return Cavity(head, state, *ears_on(scene, head, table.heard))


def snare_of(scene: Scene, under: Cavity, step_s: float) -> Snare:
    """The wires, along x, side by side about the middle of the second head. `calibrate` presses them on."""
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


def rim_of(scene: Scene, step_s: float) -> Rim:
    """The hoop's modes within the mesh's reach; each rings as many periods as the lowest, and is struck the weaker the
    higher it is."""
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
