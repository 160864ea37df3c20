"""`tension`: a hard stroke stretches the head and raises its tension, so the pitch glides down (tension modulation).

Kirchhoff and Carrier's law for strings, applied to a membrane, whose tension is the same all over (Kirchhoff,
"Vorlesungen ueber Mechanik", 1883; Carrier, "On the non-linear vibration problem of the elastic string", Q. Appl. Math.
3, 1945). The tension follows S = <u, L u>, the head's own stretch: T/T0 - 1 = E h/(2 (1 - nu^2) T0) times the mean
square of the slope, here q/tau with q = kappa S. Its energy is V = kappa S^2/4. Above q_most, the scene's limit, the
pull is constant and V grows linearly: the step of a mesh allows for so much and no more.

In discrete time S stands between two steps, S- = <u, L u-> and S+ = <u+, L u>, and the pull is the discrete gradient q
= 2 (V(S+) - V(S-))/(S+ - S-) (Gonzalez, "Time integration and discrete Hamiltonian systems", J. Nonlinear Sci. 6,
1996). S+ - S- = -sum M A u (u+ - u-) holds exactly and u+ is linear in q, so one number is solved for, in closed form.
What V gives the head it loses itself, however hard the stroke, and nothing is carried along that could drift. In the
fourth order L is the same, of second order: what the tension adds is small, and by this L it is the truer. A tension
that lags by a step instead makes the energy grow a thousandfold. A bank of modes does the same with its own S
(drumstick.drum.modal.stretch). Kernels: audio thread.
"""

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import air, internal_loss, muffle
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.membrane.sweep import laplacian_at, stretched
from drumstick.drum.membrane.terms import Terms
from drumstick.parameters.declare import Quantity, number
from drumstick.parameters.drum import Drum
from realtime.kernels.jit import njit, only_with
from realtime.records import ABSENT, Record, Records, Rows, dtype_of, is_there

if TYPE_CHECKING:
    from drumstick.drum.effects.building import Building
    from drumstick.drum.effects.muffle import Muffle
    from drumstick.drum.engine import Engine


_SLACKEST = 0.01  # GPa: a slider's low end, where the pitch stays but for a cent


@dataclass(frozen=True)
class TensionTable:
    """A hard stroke stretches the head: the pitch glides down as it calms. Of glide_cents and young_GPa the one that
    counts can be set live: young_GPa where it is above 0 (then from 0.01 GPa up), glide_cents elsewhere."""

    glide_cents: float = number(
        60.0,
        0.0,
        1200.0,
        "cents",
        "Pitch rise after a full-scale stroke at half radius, mean over the first period after contact; ignored if "
        "young_GPa is above 0",
        wire="tension.glide",
        rebuilds=True,
    )
    young_GPa: float = number(
        0.0,
        0.0,
        50.0,
        "GPa",
        "Young's modulus of the head (polyester: 3.5 to 5.5); above 0 it sets the glide, with thickness_mm and poisson",
        wire="tension.young",
        rebuilds=True,
    )
    thickness_mm: float = number(0.19, 0.01, 5.0, "mm", "Thickness of the head, with young_GPa")
    poisson: float = number(0.35, 0.0, 0.5, "1", "Poisson's ratio of the head, with young_GPa")
    most_cents: float = number(
        0.0,
        0.0,
        1200.0,
        "cents",
        "Upper limit of the pitch rise; a higher limit makes a mesh coarser. 0: automatic, a rise in tension of 2.5 "
        "times that of glide_cents, or 240 cents with young_GPa",
    )

    def live_quantities(self, declared: Mapping[str, Quantity]) -> dict[str, Quantity]:
        """The one that says how far the pitch glides in this scene; the other would change nothing."""
        if self.young_GPa == 0.0:
            return {"glide_cents": declared["glide_cents"]}
        # Never 0, at which the other one would count.
        low = min(_SLACKEST, self.young_GPa)
        return {"young_GPa": dataclasses.replace(declared["young_GPa"], low=low, scale="log")}


TABLE = TensionTable
ON_MODES = True
_ROOM, _MOST_CENTS = 2.5, 240.0  # a mode's stretch comes to twice its mean, and several meet


class TensionState(Record):
    """q_most and kappa as above, the last q; tau of the head, what of it is in the weights (`weight_scale`), 1 + s
    (`loss_divisor`); eta of the internal loss; for a bank of modes all of these are 1, and eta is 0. The step's
    equation, S+ = before - x - y q, for those who move the head by what q leaves of it.
    """

    q_most: float
    kappa: float
    pull: float
    tau: float
    weight_scale: float
    loss_divisor: float
    eta: float
    before: float
    x: float
    y: float


STATE = dtype_of(TensionState)
_NEAR = 1e-9  # of their size


class Tension(NamedTuple):
    """state (1,) of STATE; share (J,), of a mesh: each junction's mass, less what a muffle takes of its movement."""

    state: Rows[TensionState]
    share: npt.NDArray[np.float32] = ABSENT


def tension_rise_of_cents(cents: float) -> float:
    """Rise of the tension, over the tension at rest, that raises all pitches by so much."""
    return 2.0 ** (cents / 600.0) - 1.0


def tension_rise(table: TensionTable) -> float:
    """The most that the tension may rise, over the tension at rest."""
    if table.most_cents > 0.0:
        return tension_rise_of_cents(table.most_cents)
    return (
        tension_rise_of_cents(_MOST_CENTS)
        if table.young_GPa > 0.0
        else _ROOM * tension_rise_of_cents(table.glide_cents)
    )


def is_in_metres(table: TensionTable) -> bool:
    """True when the head stiffens by its own numbers."""
    return table.young_GPa > 0.0


def mistakes(table: TensionTable, drum: Drum) -> Iterator[tuple[str, str]]:
    """A limit below what is asked for."""
    if table.young_GPa == 0.0 and table.most_cents > 0.0:
        # A mode's stretch comes to twice its mean.
        least = 600.0 * math.log2(1.0 + 2.0 * (2.0 ** (table.glide_cents / 600.0) - 1.0))
        if table.most_cents < least:
            yield (
                "most_cents",
                f"{table.most_cents:g} cents leave no room for glide_cents = {table.glide_cents:g}, a mean:"
                f" give at least {math.ceil(least)}, or leave it out",
            )


def _own_kappa(table: TensionTable, unit_m: float, radius_m: float) -> float:
    # Of the head's own numbers, for the integral of the square of the slope over a head of radius 1. The tension is
    # 1/unit_m: a renderer's displacement of 1 is what 1 N does where the tension is 1 N/m.
    membrane = 1e9 * table.young_GPa * 1e-3 * table.thickness_mm / (1.0 - table.poisson**2)
    return membrane * unit_m**3 / (2.0 * math.pi * radius_m**2)


def _state_of(building: "Building", tau: float) -> Records:
    # `calibrate` finds kappa for glide_cents; until then the head is far too slack to stiffen.
    drum = building.scene.drum
    table: TensionTable = drum.effects["tension"]
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    fields["q_most"], fields["tau"] = tau * tension_rise(table), tau
    fields["kappa"] = tau * _own_kappa(table, building.unit_m, drum.radius_m)
    fields["weight_scale"] = fields["loss_divisor"] = 1.0
    return state


def part_of(building: "Building") -> Tension:
    """The head at rest."""
    if not is_there(building.lattice):
        return Tension(_state_of(building, 1.0))
    lattice, numbers, muffled = building.lattice, building.numbers, building.parts.get("muffle")
    state = _state_of(building, numbers.scheme.tau)
    fields: Record = state[0]
    # <u, L u> of a mesh counts a junction as 1, and its neighbours at a distance of 1.
    fields["kappa"] *= 4.0 * lattice.topology.row_height
    fields["weight_scale"] = numbers.weight_scale
    fields["loss_divisor"], fields["eta"] = numbers.loss_divisor, numbers.losses.eta
    share = aligned((lattice.weights.size,))
    inside = np.flatnonzero(lattice.weights)
    share[inside] = 1.0 / (lattice.topology.neighbours * lattice.weights.ravel()[inside])
    if muffled is not None:
        share[muffled.places] *= 1.0 - muffled.state["g"]
    return Tension(state, share)


@njit()
def _energy(state: TensionState, stretch: float) -> float:
    # 2 V.
    size = abs(stretch)
    if state.kappa * size <= state.q_most:
        return 0.5 * state.kappa * size * size
    return state.q_most * (size - 0.5 * state.q_most / state.kappa)


@njit()
def energy(state: TensionState, stretch: float) -> float:
    """V."""
    return 0.5 * _energy(state, stretch)


@njit()
def _pull(state: TensionState, stretch: float) -> float:
    return min(max(state.kappa * stretch, -state.q_most), state.q_most)


@njit()
def _gradient(state: TensionState, before: float, held: float, after: float) -> float:
    # held: 2 V(S-). Of stretches so near to each other the pull in their middle will do.
    if abs(after - before) <= _NEAR * (abs(after) + abs(before)):
        return _pull(state, 0.5 * (before + after))
    return (_energy(state, after) - held) / (after - before)


@njit()
def _beyond(state: TensionState, before: float, x: float, y: float) -> float:
    # `solved`, where S- or S+ lies beyond what the pull follows. S+ - S- + x + y q grows with S+: its signs at the two
    # corners of V say between which S+ lies, and there it is the root of a quadratic.
    corner = state.q_most / state.kappa
    held = _energy(state, before)
    up = corner - before + x + y * _gradient(state, before, held, corner)
    down = -corner - before + x + y * _gradient(state, before, held, -corner)
    if up >= 0.0 >= down:
        # S- is beyond, on the side `sign`, and S+ is not.
        sign = 1.0 if before > 0.0 else -1.0
        size = abs(before) - corner
        a = 1.0 + 0.5 * y * state.kappa
        b = sign * x + y * state.kappa * abs(before)
        c = 0.5 * y * state.kappa * size * size
        moved = -sign * (b + math.sqrt(max(b * b - 4.0 * a * c, 0.0))) / (2.0 * a)
        after = min(max(before + moved, -corner), corner)
    else:
        sign = 1.0 if up < 0.0 else -1.0
        own = sign * before
        if own >= corner:  # both on the same side
            return sign * state.q_most
        b = sign * x + y * state.q_most
        c = -2.0 * y * state.q_most * own
        if own > -corner:
            c = 0.5 * y * state.kappa * (corner - own) * (corner - own)
        root = math.sqrt(b * b + 4.0 * c)
        after = before + sign * (2.0 * c / (b + root) if b > 0.0 else 0.5 * (root - b))
    return _gradient(state, before, held, after)


@njit()
def solved(state: TensionState, before: float, x: float, y: float) -> float:
    """q, from S- and S+ = S- - x - y q. V is convex and y not negative, so there is one solution."""
    half = 0.5 * state.kappa
    after = (before * (1.0 - half * y) - x) / (1.0 + half * y)
    if state.kappa * max(abs(before), abs(after)) <= state.q_most:
        return half * (before + after)
    return _beyond(state, before, x, y)


@only_with("muffle")
def _lighten(engine: "Engine") -> None:
    tension: Tension = engine.effects.tension
    patches: Muffle = engine.effects.muffle
    free = np.float32(1.0 - patches.state[0].g)
    for i in range(patches.places.shape[0]):
        tension.share[patches.places[i]] = free * patches.masses[i]


@only_with("head")
def _resume_on_mesh(engine: "Engine") -> None:
    if muffle.has_moved(engine):
        _lighten(engine)


@only_with("tension")
def resume(engine: "Engine") -> None:
    """Take up what a muffle took up: it comes before in the registry."""
    _resume_on_mesh(engine)


@only_with("tension")
def before_sweep(engine: "Engine") -> None:
    """Count the masses under a muffle anew where it has moved."""
    if muffle.has_moved(engine):
        _lighten(engine)


@only_with("tension")
def neighbour_gain(engine: "Engine", q: float) -> Any:
    """1 + q/tau."""
    return np.float32(1.0 + q / engine.control[0].tau)


@only_with("tension", otherwise=0.0)
def own_loss(engine: "Engine", q: float) -> float:
    """By how much less u counts in its own next value; with internal losses that goes with the neighbours' sum."""
    state: TensionState = engine.effects.tension.state[0]
    return q / engine.control[0].loss_divisor if state.eta == 0.0 else 0.0


@only_with("tension")
def tightness(engine: "Engine", q: float) -> Any:
    """Gain of A u: q over 1 + s."""
    return np.float32(q / engine.control[0].loss_divisor)


@njit()
def _stretches(engine: "Engine", u: Any, u_old: Any) -> tuple[float, float, float, float]:
    # P, Q, R and T of the head.
    terms = Terms(
        u_gain=engine.control[0].own_gain,
        u_old_gain=None,
        neighbour_gain=None,
        push=None,
        momentum=internal_loss.momentum(engine),
        rho=internal_loss.rho(engine),
        eta=None,
        extra=None,
        extra_gain=None,
        total=None,
    )
    return stretched(engine.head, u, u_old, engine.effects.tension.share, terms)


@only_with("laplacian", otherwise=(0.0, 0.0, 0.0, 0.0))
def _stretches_fourth(engine: "Engine", u: Any, u_old: Any) -> tuple[float, float, float, float]:
    # The same in the fourth order; P has what the head's own pull moves besides.
    control = engine.control[0]
    state: TensionState = engine.effects.tension.state[0]
    own = 0.5 * state.loss_divisor if state.eta == 0.0 else 1.0 + state.eta
    terms = Terms(
        u_gain=np.float32(own * control.order_2),
        u_old_gain=None,
        neighbour_gain=np.float32(own * control.order_4),
        push=None,
        momentum=internal_loss.momentum(engine),
        rho=internal_loss.rho(engine),
        eta=None,
        extra=u,
        extra_gain=None,
        total=None,
    )
    return stretched(engine.head, engine.laplacian, u_old, engine.effects.tension.share, terms)


@only_with("laplacian", otherwise=False)
def _is_fourth(engine: "Engine") -> bool:
    return True


@only_with("tension", otherwise=0.0)
def tightened(engine: "Engine", u: Any, u_old: Any, push: float) -> float:
    """q of this step. push: f of the whole head. In the fourth order A u is there already."""
    tension: Tension = engine.effects.tension
    state, share = tension.state[0], tension.share
    head, own_gain = engine.head, engine.control[0].own_gain
    fourth = _is_fourth(engine)
    p, q, r, t = _stretches_fourth(engine, u, u_old) if fourth else _stretches(engine, u, u_old)
    moved = push * r
    forces = engine.forces
    for i in range(engine.control[0].forces):
        at = forces[i].junction
        moved += share[at] * laplacian_at(head, u, at, own_gain) * forces[i].step
    moved += air.stretched(engine, u, share, own_gain)
    # The weights hold `weight_scale` times A; the step divides all but a force's own movement by 1 + s.
    y = q / (state.weight_scale * state.weight_scale * state.loss_divisor)
    own = 0.0 if fourth else (1.0 + state.eta) * state.tau * y  # else P has it
    x = own + moved / state.weight_scale
    if state.eta > 0.0:
        x += p / state.weight_scale
    else:
        x += 2.0 * p / (state.weight_scale * state.loss_divisor)
    before = -(t + muffle.hidden_stretch(engine, u, own_gain)) / state.weight_scale
    state.before, state.x, state.y = before, x, y
    state.pull = solved(state, before, x, y)
    return state.pull
