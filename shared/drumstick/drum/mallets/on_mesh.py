"""Mallets on a mesh: a push moves junctions under the tip alone in the step in which it acts.

So mallets apart from each other are solved one by one; one that comes down where another still is, takes it away, with
what it holds. Kernels: audio thread; no allocation.
"""

import math
from typing import TYPE_CHECKING, Any

from drumstick.drum.effects import composition
from drumstick.drum.mallets import patch
from drumstick.drum.mallets.mallet import (
    GONE,
    PLAYING,
    arrive,
    fly,
    forget,
    free_depth_after_step,
    lay_on_mesh,
    starts_in_this_step,
    take_away,
)
from drumstick.drum.mallets.tip import solve_contact
from drumstick.drum.membrane.interpolation import drawn_in
from drumstick.drum.memory.mallets import POOL, Patches
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine


@njit()
def _clear(engine: "Engine", slot: int) -> None:
    # Whatever another mallet would meet where this one comes down.
    state, pool = engine.mallets.state[0], engine.mallets.pool
    mallet, limit = pool[slot], 1.0 - engine.head.grid[0].spacing
    x, y = drawn_in(mallet.x, mallet.y, limit)  # as `patch.place_tip` puts them
    for number in range(state.oldest, state.begun):
        other = pool[number % POOL]
        if other.stage == PLAYING:
            other_x, other_y = drawn_in(other.x, other.y, limit)
            if math.hypot(other_x - x, other_y - y) < 2.0 * state.radius:
                take_away(engine, number % POOL)


@only_with("mallets")
def start_due_mallets(engine: "Engine", u: Any, u_old: Any) -> None:
    """Let mallets arrive whose instant has come: before the sweep, while `u_old` still holds u-."""
    state, pool = engine.mallets.state[0], engine.mallets.pool
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        if composition.has_moved(engine) and pool[slot].stage != GONE:
            lay_on_mesh(engine, slot)
        if starts_in_this_step(pool[slot]):
            _clear(engine, slot)
            y = state.unit_m * patch.under(engine.mallets.patches, slot, u)
            arrive(engine, slot, y, state.unit_m * patch.under(engine.mallets.patches, slot, u_old))


@njit()
def _keep_moving(patches: Patches, slot: int, momentum: Any, force: float) -> None:
    if momentum is not None:  # decided by the type, at compile time
        patch.push(patches, slot, momentum, force)


@only_with("mallets", otherwise=0.0)
def strike(engine: "Engine", u_new: Any) -> float:
    """Let mallets and head meet after all else has moved u+; returns by how much its sum changed."""
    state, pool, changed = engine.mallets.state[0], engine.mallets.pool, 0.0
    if state.begun == state.oldest:
        return changed
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        if pool[slot].stage != PLAYING:
            continue
        y_free = state.unit_m * patch.under(engine.mallets.patches, slot, u_new)
        after, force = solve_contact(engine.mallets.tips[slot], free_depth_after_step(engine, slot, y_free))
        fly(engine, slot, after, force)
        if force > 0.0:
            patch.push(engine.mallets.patches, slot, u_new, force)
            _keep_moving(engine.mallets.patches, slot, composition.momentum(engine), force)
            changed += pool[slot].sum_per_newton * force
    forget(engine)
    return changed
