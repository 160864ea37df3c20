"""Mallets that meet the moving head, from one strike message each: excitation `mallet`.

A strike's speed and place come from its message, all else from `[mallet]`. The mallet flies by itself, x+ = 2 x - x- -
F T^2/m, from the instant of the strike, when it is where the head then is; the head's own movement decides how they
meet, and whether they meet again: no hand holds it. It is forgotten once it is farther above the head's rest than the
blow was deep. Lengths are in metres, positive into the drum; a renderer's displacement of 1 is `unit_m`.

The law and why it makes no energy: drumstick.drum.mallets.tip. How a renderer is read and pushed under a tip, and
what happens where mallets meet: `on_mesh` and `on_modes`.

The pool has a fixed size; when it is full, a new mallet takes the place of the oldest. Kernels: audio thread; no
allocation.
"""

import math
from typing import TYPE_CHECKING

from drumstick.drum.effects import composition
from drumstick.drum.mallets import patch, shares
from drumstick.drum.mallets.tip import advance_tip, reset_tip
from drumstick.drum.memory.bank import STEPS
from drumstick.drum.memory.mallets import POOL, MalletMotion, MalletsState
from drumstick.drum.memory.strikes import StrikeEvent
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

GONE, COMING, PLAYING = 0, 1, 2


_MIN_REACH_S = 1e-3  # at the blow's speed: so high above the head's rest a mallet is followed in any case
_MIN_LEFT = 1e-3  # of its mass: what meets the head in any case, so that a mallet on the rim is one too
_MAX_S = 1.0  # a mallet that stays near the head for so long without touching it is forgotten


@only_with("mallets", otherwise=0)
def playing(engine: "Engine") -> int:
    """Number of mallets that may still meet the head."""
    state = engine.mallets.state[0]
    return int(state.begun - state.oldest)


@only_with("mallets", otherwise=STEPS)
def steps_alone(engine: "Engine") -> int:
    """Steps that the head takes before a mallet may meet it, STEPS at most: 0 while one plays."""
    state, pool, steps = engine.mallets.state[0], engine.mallets.pool, STEPS
    for number in range(state.oldest, state.begun):
        mallet = pool[number % POOL]
        if mallet.stage == PLAYING:
            return 0
        if mallet.stage == COMING:  # as `starts_in_this_step` counts
            steps = min(steps, max(0, math.floor(-mallet.age)))
    return steps


@only_with("head")
def lay_on_mesh(engine: "Engine", slot: int) -> None:
    """Lay the tip where the mallet comes down: what of the head is under it, and how it gives way."""
    state, mallet, tip = engine.mallets.state[0], engine.mallets.pool[slot], engine.mallets.tips[slot]
    compliance, total = patch.place_tip(engine, slot, mallet.x, mallet.y, state.radius)
    tip.compliance = mallet.own_compliance + state.unit_m * compliance
    mallet.sum_per_newton = total


@only_with("modal")
def _lay_on_modes(engine: "Engine", slot: int) -> None:
    state, mallet = engine.mallets.state[0], engine.mallets.pool[slot]
    compliance = shares.place_tip(engine, slot, mallet.x, mallet.y)
    state.foreseen = -1
    engine.mallets.tips[slot].compliance = mallet.own_compliance + state.unit_m * compliance


@only_with("mallets")
def lay_again(engine: "Engine") -> None:
    """Lay all tips on a bank of modes anew, which gives way otherwise than before."""
    state, pool = engine.mallets.state[0], engine.mallets.pool
    for number in range(state.oldest, state.begun):
        if pool[number % POOL].stage != GONE:
            _lay_on_modes(engine, number % POOL)


@only_with("mallets", otherwise=False)
def start(engine: "Engine", event: StrikeEvent, age: float) -> bool:
    """Take up a strike whose instant is at -age, in steps; False for a drum that has no mallets."""
    state = engine.mallets.state[0]
    if not event.speed_m_per_s > 0.0:
        return True  # it never comes
    slot = state.begun % POOL
    mallet = engine.mallets.pool[slot]
    if state.begun - state.oldest == POOL:
        state.replaced += 1 if mallet.stage != GONE else 0
        state.oldest += 1
    mallet.stage, mallet.x, mallet.y = COMING, event.x, event.y
    mallet.speed, mallet.age, mallet.force = event.speed_m_per_s, age, 0.0
    reset_tip(engine.mallets.tips[slot], 0.0, 0.0)
    mallet.own_compliance = state.own_compliance / max(
        1.0 - composition.taken_share(engine, event.x, event.y), _MIN_LEFT
    )
    state.begun += 1
    lay_on_mesh(engine, slot)
    _lay_on_modes(engine, slot)
    return True


@njit()
def starts_in_this_step(mallet: MalletMotion) -> bool:
    """True when its instant falls into the coming step; one that is still to come has a step less to wait."""
    if mallet.stage != COMING:
        return False
    if mallet.age <= -1.0:
        mallet.age += 1.0
        return False
    return True


@njit()
def take_away(engine: "Engine", slot: int) -> None:
    """Another mallet comes down where this one is."""
    mallet = engine.mallets.pool[slot]
    mallet.stage = GONE
    mallet.force = 0.0
    if engine.mallets.tips[slot].depth > 0.0:
        engine.mallets.state[0].lifted += 1
    reset_tip(engine.mallets.tips[slot], 0.0, 0.0)


@njit()
def arrive(engine: "Engine", slot: int, y: float, y_before: float) -> None:
    """The mallet is above the head (at y, before that at y_before, m), on a way that reaches y at its instant.

    Where the head goes faster than it, it starts as far behind as it then is.
    """
    state, mallet = engine.mallets.state[0], engine.mallets.pool[slot]
    way = mallet.speed * state.step_s
    mallet.now = min(y + way * min(mallet.age, 0.0), y_before + way)
    mallet.before = mallet.now - way
    reset_tip(engine.mallets.tips[slot], mallet.now - y, mallet.before - y_before)
    mallet.deepest = _MIN_REACH_S * mallet.speed
    mallet.stage = PLAYING
    composition.struck(engine, mallet.x, mallet.y, full_impulse(state, mallet.speed))


@njit()
def full_impulse(state: MalletsState, speed: float) -> float:
    """Impulse that a whole mallet gives to something that throws it back as fast as it came, N steps."""
    return float(2.0 * speed * state.step_s / state.own_compliance)


@njit()
def free_depth_after_step(engine: "Engine", slot: int, y_free: float) -> float:
    """Depth of the tip after this step without its own push, over a head that would be at y_free, m."""
    mallet = engine.mallets.pool[slot]
    return float(2.0 * mallet.now - mallet.before - y_free)


@njit()
def fly(engine: "Engine", slot: int, after: float, force: float) -> None:
    """One step of a mallet that pushes with `force`, N, and whose tip is then `after` deep, m."""
    state, mallet, tip = engine.mallets.state[0], engine.mallets.pool[slot], engine.mallets.tips[slot]
    advance_tip(tip, after)
    now = 2.0 * mallet.now - mallet.before - mallet.own_compliance * force
    mallet.before = mallet.now
    mallet.now = now
    mallet.deepest = max(mallet.deepest, now)
    mallet.force = force
    mallet.age += 1.0
    if after <= 0.0 and tip.depth_before <= 0.0:
        rises = mallet.now < mallet.before and mallet.now < -mallet.deepest
        if rises or mallet.age * state.step_s > _MAX_S:
            mallet.stage = GONE


@njit()
def forget(engine: "Engine") -> None:
    """Remove mallets that are gone from the pool, after a step, in their turn."""
    state, pool = engine.mallets.state[0], engine.mallets.pool
    while state.oldest < state.begun and pool[state.oldest % POOL].stage == GONE:
        state.oldest += 1
