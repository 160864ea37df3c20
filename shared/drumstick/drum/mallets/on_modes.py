"""Mallets on a bank of modes: a push moves all modes, so it is felt under every other mallet in the same step.

With free_i, how deep tip i would be without any push, and G, what a newton at one gives under another, the depths are
d = free - G F(d), G symmetric and positive with what the mallets themselves give on its diagonal: the pushes are the
gradient of a convex energy, and there is one solution. Each mallet meets what the others leave of the step, by turns,
until none changes (Gauss-Seidel); alone it does so once, under the pull that drumstick.drum.mallets.under_tension
finds. What is left of the difference is all that the energy can be wrong by, 1e-9 of a push; 2e-6 of the largest where
drumstick.drum.mallets.in_touch sums the height in single precision.

Where a newton at one tip moves another more than by half as much, in the square, as itself, turns would take long, and
they are for the bank in one place: the one that comes down takes the other away, with what it holds. Kernels: audio
thread; no allocation.
"""

from typing import TYPE_CHECKING

from drumstick.drum.mallets import in_touch, shares, under_tension
from drumstick.drum.mallets.mallet import (
    PLAYING,
    arrive,
    fly,
    forget,
    free_depth_after_step,
    starts_in_this_step,
    take_away,
)
from drumstick.drum.mallets.tip import solve_contact
from drumstick.drum.memory.mallets import POOL
from drumstick.drum.modal import stretch
from realtime.kernels.jit import njit, only_with

if TYPE_CHECKING:
    from drumstick.drum.effects.tension import TensionState
    from drumstick.drum.engine import Engine

_MAX_TURNS = 64
_CLOSE = 1e-9  # of the largest push
_TOGETHER = 0.5
_SETTLED = 1e-10  # of the largest pull


@njit()
def _clear(engine: "Engine", slot: int) -> None:
    # Whatever another mallet would meet where this one comes down.
    mallets = engine.mallets
    state, unit_m = mallets.state[0], mallets.state[0].unit_m
    for number in range(state.oldest, state.begun):
        other = number % POOL
        if mallets.pool[other].stage == PLAYING:
            both = unit_m * mallets.shares.mutual_compliance[slot, other]
            if both * both > _TOGETHER * mallets.tips[slot].compliance * mallets.tips[other].compliance:
                take_away(engine, other)


@njit()
def _start_due_mallets(engine: "Engine") -> int:
    # Mallets whose instant has come arrive. Returns how many play.
    state, pool, playing = engine.mallets.state[0], engine.mallets.pool, 0
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        if starts_in_this_step(pool[slot]):
            _clear(engine, slot)
            y, y_before = shares.under(engine, slot)
            arrive(engine, slot, state.unit_m * y, state.unit_m * y_before)
    for number in range(state.oldest, state.begun):
        playing += 1 if pool[number % POOL].stage == PLAYING else 0
    return playing


@njit()
def _left(engine: "Engine", slot: int) -> float:
    # How deep a tip would be without its own push, for the present pushes of the others.
    mallets = engine.mallets
    state, mutual_compliance = mallets.state[0], mallets.shares.mutual_compliance
    depth = mallets.pool[slot].free_depth
    for number in range(state.oldest, state.begun):
        other = number % POOL
        if other != slot and mallets.pool[other].stage == PLAYING:
            depth -= state.unit_m * mutual_compliance[slot, other] * mallets.pool[other].force
    return float(depth) - _drawn_away(engine, slot)


@only_with("tension", otherwise=0.0)
def _drawn_away(engine: "Engine", slot: int) -> float:
    # By how much less deep the head's pull leaves the tip.
    tight: TensionState = engine.effects.tension.state[0]
    return float(engine.mallets.pool[slot].depth_per_pull * tight.pull)


@only_with("tension")
def _look(engine: "Engine", slot: int) -> None:
    mallet, state = engine.mallets.pool[slot], engine.mallets.state[0]
    # A pull of 1 moves the tip as a newton stretches the head: both are the same sum over the modes.
    newton = state.newton_ahead if state.foreseen == slot else stretch.of_newton(engine, slot)
    mallet.stretch_per_newton = -newton
    mallet.depth_per_pull = state.unit_m * mallet.stretch_per_newton


@only_with("tension", otherwise=True)
def _answered(engine: "Engine") -> bool:
    # The tension pulls as the present pushes stretch it; True when it pulls as before.
    mallets = engine.mallets
    state: TensionState = engine.effects.tension.state[0]
    x, before = 0.0, state.pull
    for number in range(mallets.state[0].oldest, mallets.state[0].begun):
        slot = number % POOL
        if mallets.pool[slot].stage == PLAYING:
            x += mallets.pool[slot].stretch_per_newton * mallets.pool[slot].force
    return bool(abs(stretch.pull_for(engine, x) - before) <= _SETTLED * state.q_most)


@only_with("tension")
def _agree(engine: "Engine") -> None:
    # One mallet and the tension: where turns would lead too, which take three times as long.
    state = engine.mallets.state[0]
    tight: TensionState = engine.effects.tension.state[0]
    alone = stretch.pull(engine)
    tight.pull = under_tension.agreed(engine)
    state.last_pull_change = tight.pull - alone


@njit()
def _turn(engine: "Engine") -> tuple[float, float]:
    # Each meets what the others leave. Returns the largest change of a push, and the largest push.
    mallets, changed, most = engine.mallets, 0.0, 0.0
    state = mallets.state[0]
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        mallet = mallets.pool[slot]
        if mallet.stage == PLAYING:
            _, force = solve_contact(mallets.tips[slot], _left(engine, slot))
            changed = max(changed, abs(force - mallet.force))
            most = max(most, force)
            mallet.force = force
    return changed, most


@njit()
def _take_turns(engine: "Engine") -> None:
    for _ in range(_MAX_TURNS):
        changed, most = _turn(engine)
        if _answered(engine) and changed <= _CLOSE * most:
            break


@only_with("modal")
def _meet(engine: "Engine") -> None:
    mallets = engine.mallets
    state, pool = mallets.state[0], mallets.pool
    if state.begun == state.oldest:
        return
    playing, newest = _start_due_mallets(engine), -1
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        if pool[slot].stage == PLAYING:
            ahead = state.height_ahead if state.foreseen == slot else shares.ahead(engine, slot)
            pool[slot].free_depth = free_depth_after_step(engine, slot, state.unit_m * ahead)
            _look(engine, slot)
            newest = slot
    state.foreseen = -1
    if playing == 1:
        _agree(engine)
        _turn(engine)
    elif playing > 1:
        _take_turns(engine)
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        if pool[slot].stage == PLAYING:
            after = _left(engine, slot) - mallets.tips[slot].compliance * pool[slot].force
            pool[slot].free_depth = after  # none flies, and may be gone, before all depths are known
    for number in range(state.oldest, state.begun):
        slot = number % POOL
        if pool[slot].stage == PLAYING:
            force = pool[slot].force
            fly(engine, slot, pool[slot].free_depth, force)
            if force > 0.0 or slot == newest:
                in_touch.push(engine, slot, slot == newest)
    forget(engine)


@only_with("mallets")
def strike(engine: "Engine") -> None:
    """Let mallets and head meet before the step of a bank, and drive the modes by their pushes."""
    _meet(engine)
