"""`tension`: a hard stroke stretches the head, which sounds higher until it has calmed down.

As in Kirchhoff and Carrier's membrane the tension follows S = <u, L u>, the head's own stretch: by q(S) more than tau.
Theirs grows without end, q = kappa S, and a mesh at its limit of stability has no room for that: here q comes to
q_most S/(|S| + half), and tau leaves room for q_most. Its energy is V = (q_most/2) (|S| - half ln(1 + |S|/half)).

In discrete time S stands between two steps, S- = <u, L u-> and S+ = <u+, L u>, and the pull is the discrete gradient
q = 2 (V(S+) - V(S-))/(S+ - S-) (Gonzalez, "Time integration and discrete Hamiltonian systems", J. Nonlinear Sci. 6,
1996). S+ - S- = -sum M A u (u+ - u-) holds exactly and u+ is linear in q, so one number is solved for; what V gives the
head it loses itself, however hard the stroke, and nothing is carried along that could drift. A tension that lags by a
step instead makes the energy grow a thousandfold. Kernels: audio thread.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import internal_loss, muffle
from drumstick.drum.membrane.heads import aligned
from drumstick.drum.membrane.sweep import bend_at, stretched
from drumstick.parameters.declare import number
from realtime.kernels.jit import njit, only_with
from realtime.records import Record, Records, Rows, dtype_of

if TYPE_CHECKING:
    from drumstick.drum.effects.registry import Building
    from drumstick.drum.engine import Engine


@dataclass(frozen=True)
class TensionTable:
    """A hard stroke stretches the head: the pitch glides down as it calms."""

    glide_cents: float = number(
        60.0, 0.0, 1200.0, "cents", "How far a stroke of full scale at half radius raises the pitch"
    )


TABLE = TensionTable


class TensionState(Record):
    """q_most and half as above, the last q; tau of the head, what of it is in the weights (`baked`), 1 + s; eta of the
    internal loss. The step's equation, S+ = before - x - y q, for those who move the head by what q leaves of it.
    """

    q_most: float
    half: float
    pull: float
    tau: float
    baked: float
    held_back: float
    eta: float
    before: float
    x: float
    y: float


STATE = dtype_of(TensionState)
_NEAR = 1e-4  # stretches so near to each other have the gradient of their middle, to 1e-9
_ITERATIONS = 60
_QUICK = 6  # turns of Newton's method, before every other one is a bisection
_CLOSE = 1e-12


class Tension(NamedTuple):
    """state (1,) of STATE; share (J,): each junction's mass, less what a muffle takes of its movement."""

    state: Rows[TensionState]
    share: npt.NDArray[np.float32]


def part_of(building: "Building") -> Tension:
    """`calibrate` finds `half`; until then the head is far too slack to stiffen."""
    lattice, numbers, muffled = building.lattice, building.numbers, building.parts.get("muffle")
    state: Records = np.zeros(1, STATE)
    fields: Record = state[0]
    fields["q_most"], fields["half"] = numbers.glide * numbers.scheme.tau, 1e300
    fields["tau"], fields["baked"] = numbers.scheme.tau, numbers.baked
    fields["held_back"], fields["eta"] = numbers.held_back, numbers.losses.eta
    share = aligned((lattice.weights.size,))
    inside = np.flatnonzero(lattice.weights)
    share[inside] = 1.0 / (lattice.topology.neighbours * lattice.weights.ravel()[inside])
    if muffled is not None:
        share[muffled.places] *= 1.0 - muffled.state["g"]
    return Tension(state, share)


@njit()
def _energy(state: TensionState, stretch: float) -> float:
    # 2 V.
    ratio = abs(stretch) / state.half
    return state.q_most * state.half * (ratio - math.log1p(ratio))


@njit()
def _pull(state: TensionState, stretch: float) -> float:
    return state.q_most * stretch / (abs(stretch) + state.half)


@njit()
def _gradient(state: TensionState, before: float, held: float, after: float) -> float:
    # held: 2 V(S-).
    if abs(after - before) <= _NEAR * (abs(after) + abs(before) + state.half):
        return _pull(state, 0.5 * (before + after))
    return (_energy(state, after) - held) / (after - before)


@njit()
def solved(state: TensionState, before: float, x: float, y: float, near: float) -> float:
    """q, from S- and S+ = S- - x - y q, looked for from `near` on. V is convex and y not negative, so there is one
    solution between two bounds."""
    low, high = before - x - y * state.q_most, before - x + y * state.q_most
    after, held = before - x - y * near, _energy(state, before)
    for turn in range(_ITERATIONS):
        q = _gradient(state, before, held, after)
        wrong = after - before + x + y * q
        if wrong > 0.0:
            high = after
        else:
            low = after
        # Newton's method; its slope is at least 1.
        apart = after - before
        rise = (_pull(state, after) - q) / apart if abs(apart) > _NEAR * state.half else 0.0
        following = after - wrong / (1.0 + y * max(rise, 0.0))
        # A stretch of a thousand times `half` has a corner at 0 over which Newton's method goes to and fro.
        if not low < following < high or (turn > _QUICK and turn & 1):
            following = 0.5 * (low + high)
        if abs(following - after) <= _CLOSE * (abs(following) + state.half):
            break
        after = following
    return _gradient(state, before, held, after)


@only_with("tension", otherwise=0.0)
def tightened(engine: "Engine", now: Any, then: Any, push: float) -> float:
    """q of this step. push: f of the whole head."""
    state, share = engine.effects.tension.state[0], engine.effects.tension.share
    head, own_gain = engine.head, engine.control[0].own_gain
    p, q, r, t = stretched(
        head, now, then, share, own_gain, internal_loss.momentum(engine), internal_loss.rho(engine)
    )
    moved = push * r
    forces = engine.forces
    for i in range(engine.control[0].forces):
        at = forces[i].junction
        moved += share[at] * bend_at(head, now, at, own_gain) * forces[i].step
    # The weights hold `baked` times A; the step divides all but a force's own movement by 1 + s.
    y = q / (state.baked * state.baked * state.held_back)
    x = (1.0 + state.eta) * state.tau * y + moved / state.baked
    if state.eta > 0.0:
        x += p / state.baked
    else:
        x += 2.0 * p / (state.baked * state.held_back)
    before = -(t + muffle.hidden_stretch(engine, now, own_gain)) / state.baked
    state.before, state.x, state.y = before, x, y
    state.pull = solved(state, before, x, y, _pull(state, before))
    return state.pull
