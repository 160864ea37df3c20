"""Mallets on a head whose tension they change: push and pull of one step, each solved for what the other leaves of it.

The tension's pull q is the gradient of its energy over the step (drumstick.drum.effects.tension), and a push changes
the stretch at the step's end; the push F follows from how deep the tip would be, and the pull changes that. Both are
gradients of convex energies: the pull T(q) that the pushes at q ask for grows with q, by less than q does, so there is
one q = T(q), and T(q) lies between it and q. The secant finds it, in two or three turns for the glides that a head has.
The mallet's own push is then solved anew after the sweep, for the pull that was taken, so what is left of the
difference between the two is all that the energy can be wrong by. Kernels: audio thread; no allocation.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import composition, tension
from drumstick.drum.mallets import patch
from drumstick.drum.mallets.mallet import PLAYING
from drumstick.drum.mallets.tip import solve_contact
from drumstick.drum.membrane.sweep import is_triangular
from drumstick.drum.memory.mallets import POOL, TIP_LANES, Patches
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.effects.tension import TensionState
    from drumstick.drum.engine import Control, Engine

_MAX_TURNS = 8
_FLAT = -1e-6
_CLOSE = 1e-10  # of the largest pull

Floats = npt.NDArray[np.float32]


@njit(fastmath={"contract", "reassoc"})
def _laplacian(engine: "Engine", slot: int, u: Floats) -> float:
    # Under the tip, of what is free to move: how far the neighbours pull, w sum - u, as the weights are baked.
    patches, weights, grid = engine.mallets.patches, engine.head.weights, engine.head.grid[0]
    own, stride, total = engine.control[0].own_gain, grid.stride, 0.0
    for row in range(patches.rows[slot]):
        free, start = patches.free[slot, row], patches.starts[slot, row]
        centre, weight = u[start : start + TIP_LANES], weights[start : start + TIP_LANES]
        left, right = u[start - 1 : start - 1 + TIP_LANES], u[start + 1 : start + 1 + TIP_LANES]
        above, below = start - stride, start + stride
        if is_triangular(engine.head):  # two of each row beside: the nearer one, and one aside
            aside = 2 * ((start // stride - grid.centre_row) & 1) - 1
            further_up, further_down = u[above + aside :][:TIP_LANES], u[below + aside :][:TIP_LANES]
            up, down = u[above : above + TIP_LANES], u[below : below + TIP_LANES]
            for lane in range(TIP_LANES):
                neighbour_sum = (
                    left[lane] + right[lane] + up[lane] + down[lane] + further_up[lane] + further_down[lane]
                )
                total += float(free[lane]) * float(weight[lane] * neighbour_sum - own * centre[lane])
        else:
            up, down = u[above : above + TIP_LANES], u[below : below + TIP_LANES]
            for lane in range(TIP_LANES):
                neighbour_sum = left[lane] + right[lane] + up[lane] + down[lane]
                total += float(free[lane]) * float(weight[lane] * neighbour_sum - own * centre[lane])
    return total


@njit()
def _carried(patches: Patches, slot: int, rho: Any, momentum: Any) -> float:
    # By the junctions' own momentum.
    if momentum is None:  # decided by the type, at compile time
        return 0.0
    return float(rho * patch.free_under(patches, slot, momentum))


@only_with("laplacian", otherwise=(0.0, 0.0))
def _pulls_of_fourth(engine: "Engine", slot: int) -> tuple[float, float]:
    control, laplacian = engine.control[0], engine.laplacian
    stretch, again = (
        patch.free_under(engine.mallets.patches, slot, laplacian),
        _laplacian(engine, slot, laplacian),
    )
    return stretch, control.order_4 * (again + stretch) + control.order_2 * stretch


@njit()
def _pushed(patches: Patches, slot: int, pushes: Any) -> float:
    # By what pushes each junction by itself.
    if pushes is None:  # decided by the type, at compile time
        return 0.0
    return float(patch.free_under(patches, slot, pushes))


@njit()
def _pulls(engine: "Engine", slot: int, u: Floats, laplacian: Any) -> tuple[float, float]:
    # Under the tip: A u, with what is in the weights, and by how much the head's own pull moves it in a step.
    if laplacian is None:  # decided by the type, at compile time
        found = _laplacian(engine, slot, u)
        return found, found
    return _pulls_of_fourth(engine, slot)


@njit()
def _present_gain(control: "Control", laplacian: Any) -> float:
    # Of u beside A u.
    if laplacian is None:  # decided by the type, at compile time
        return control.own_gain + control.u_gain
    return control.u_gain


@njit()
def _bare(engine: "Engine", slot: int, u: Floats, u_old: Floats, pulled: float, push: float) -> float:
    # How high the head would stand under the tip after this step, without a pull and without mallets.
    control, patches = engine.control[0], engine.mallets.patches
    state: TensionState = engine.effects.tension.state[0]
    height, gone = patch.free_under(patches, slot, u), patch.free_under(patches, slot, u_old)
    found: float = patch.under(patches, slot, u_old) - gone  # what a muffle holds stays where it was
    found += push * patch.free_under(patches, slot, engine.head.weights)
    found += _pushed(patches, slot, composition.junction_pushes(engine))
    if state.eta > 0.0:
        carried = _carried(patches, slot, composition.rho(engine), composition.momentum(engine))
        return found + height + carried + (1.0 + state.eta) * pulled
    return found + _present_gain(control, engine.laplacian) * height - control.u_old_gain * gone + pulled


@njit()
def _look(engine: "Engine", u: Floats, u_old: Floats, push: float) -> None:
    # What the pushes and the pull depend on in this step, for every mallet that plays.
    mallets, control = engine.mallets, engine.control[0]
    tight: TensionState = engine.effects.tension.state[0]
    state = mallets.state[0]
    neighbours = 6.0 if is_triangular(engine.head) else 4.0
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        mallet = mallets.pool[slot]
        if mallet.stage == PLAYING:
            stretch, pulled = _pulls(engine, slot, u, engine.laplacian)
            height = _bare(engine, slot, u, u_old, pulled, push)
            mallet.free_depth = 2.0 * mallet.now - mallet.before - state.unit_m * height
            mallet.depth_per_pull = state.unit_m * stretch / (tight.weight_scale * tight.loss_divisor)
            mallet.stretch_per_newton = control.force_gain / neighbours * stretch


@njit()
def _answered(engine: "Engine", pull: float) -> float:
    # The pull that the pushes at this pull ask for.
    mallets = engine.mallets
    tight: TensionState = engine.effects.tension.state[0]
    state, stretched = mallets.state[0], 0.0
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        mallet = mallets.pool[slot]
        if mallet.stage == PLAYING:
            _, force = solve_contact(mallets.tips[slot], mallet.free_depth - mallet.depth_per_pull * pull)
            stretched += mallet.stretch_per_newton * force
    if stretched == 0.0:
        return float(tight.pull)
    return float(tension.solved(tight, tight.before, tight.x + stretched, tight.y))


@njit()
def agreed(engine: "Engine") -> float:
    """Pull that asks for itself, from the pull without mallets and how mallets lie: for those that do not meet.

    By the secant, kept between the bounds that every answer draws in.
    """
    tight: TensionState = engine.effects.tension.state[0]
    close = _CLOSE * tight.q_most
    low, high = -tight.q_most, tight.q_most
    pull = min(max(tight.pull + engine.mallets.state[0].last_pull_change, low), high)
    answer = _answered(engine, pull)
    for _ in range(_MAX_TURNS):
        wrong = answer - pull
        if abs(wrong) <= close:
            break
        if wrong > 0.0:
            low = max(low, answer)
        else:
            high = min(high, answer)
        following = answer
        again = _answered(engine, following)
        slope = (again - following - wrong) / (following - pull)  # of answer - pull; from -1 to 0
        pull, answer = following, again
        if slope < _FLAT:
            best = following - (again - following) / slope
            if low < best < high:
                pull, answer = best, _answered(engine, best)
    return answer


@only_with("tension", otherwise=0.0)
def _settled(engine: "Engine", u: Any, u_old: Any, push: float) -> float:
    state = engine.mallets.state[0]
    tight: TensionState = engine.effects.tension.state[0]
    if state.begun == state.oldest:
        return 0.0
    _look(engine, u, u_old, push)
    alone = tight.pull
    tight.pull = agreed(engine)
    state.last_pull_change = tight.pull - alone
    return float(state.last_pull_change)


@only_with("mallets", otherwise=0.0)
def pull_change_by_mallets(engine: "Engine", u: Any, u_old: Any, push: float) -> float:
    """Amount by which mallets change q, after `tension.tightened`. push: f of the whole head."""
    return float(_settled(engine, u, u_old, push))
