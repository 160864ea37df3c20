"""From the servo's rate to the mesh's: each tick's force as a parabola whose mean is the sample.

A sample is the mean force over its tick. Between two ticks the force is that of the cubic through four cumulated
samples, (7 (s_k + s_k+1) - (s_k-1 + s_k+2))/12, and within a tick the parabola between its two ends with the sample as
its mean (Colella and Woodward, "The piecewise parabolic method", J. Comput. Phys. 54, 1984, equations 1.5 to 1.9,
without their limiter, so that the force of two contacts is the sum of theirs). It is integrated over each step of the
mesh in closed form: the impulse is that of the samples, exactly, and the force is continuous. Error of fourth order in
the tick where the force is smooth. Two ticks are looked ahead; what has not come by then is guessed from the last
sample, which costs smoothness and no impulse.

A sample that is missing when its turn comes is replaced by the last one for 3 ms, then by a fade of 2 ms, and counted
once. After a sample of 0 nothing is expected. Kernels: audio thread; no allocation.
"""

import math
from typing import TYPE_CHECKING

from drumstick.drum.effects import composition
from drumstick.drum.excitation.point_force import push
from drumstick.drum.memory.timeline import Piece, StreamState
from realtime.kernels.jit import njit, only_with
from realtime.ring import drain

if TYPE_CHECKING:
    from drumstick.drum.engine import Engine

HOLD_S, FADE_S = 0.003, 0.002
_LOOK = 2  # ticks that a cell's ends need beyond it, and reach before a contact
_LOST_NS = 50_000_000  # a timeline that is so far from where it should be starts anew


@njit()
def _begin_at(state: StreamState, piece: Piece) -> None:
    # An idle timeline starts with this piece, at its instant; late, it starts now. Too near for the reach of the first
    # sample's parabolas, that reach is left out: it has no impulse.
    ahead = max((piece.start_ns - state.next_step_ns) / piece.period_ns, 0.0)
    whole = math.ceil(ahead)
    state.begin = piece.first - _LOOK if ahead >= _LOOK else piece.first
    state.tick = piece.first - int(whole)
    state.entered = state.tick - 1
    state.inside = whole - ahead
    state.period_ns = piece.period_ns
    state.ticks_per_step = state.step_ns / piece.period_ns
    state.left = state.mean = state.right = state.before = 0.0
    state.newest = piece.first - 1
    state.held = 0.0
    state.gap = 0
    state.idle = 0


@njit()
def _is_lost(state: StreamState, piece: Piece) -> bool:
    # Does the timeline not lead to this piece's instant any more?
    if piece.period_ns != state.period_ns:
        return True
    ahead = float(piece.first - state.tick) - state.inside
    return abs(state.next_step_ns + ahead * state.period_ns - piece.start_ns) > _LOST_NS


@njit()
def _lay(engine: "Engine", piece: Piece) -> None:
    # Put a piece on the timeline. Cells that are being played, or were, take no more.
    state, cells = engine.stream.state[0], engine.stream.cells
    for i in range(piece.count):
        tick = piece.first + i
        if tick <= state.entered or tick - state.tick >= cells.shape[0]:
            state.late += 1
            continue
        cell = cells[tick % cells.shape[0]]
        if cell.tick != tick:
            cell.tick = tick
            cell.force = 0.0
        cell.force += piece.forces[i]
        cell.x = piece.x
        cell.y = piece.y
        state.newest = max(state.newest, tick)


@only_with("stream", otherwise=False)
def take(engine: "Engine", block_start_ns: int, frames: int) -> bool:
    """Take up the pieces that have come, before a block; returns whether there is a force to play."""
    control, stream = engine.control[0], engine.stream
    state = stream.state[0]
    to_next_step = (control.divisor - control.phase) % control.divisor
    state.next_step_ns = block_start_ns + int(to_next_step * 1e9 / control.rate_Hz)
    state.block_ns = int(frames * 1e9 / control.rate_Hz)
    for i in range(drain(stream.ring_cells, stream.ring_slots, stream.incoming)):
        piece = stream.incoming[i]
        if piece.epoch != state.epoch:
            state.epoch = piece.epoch
            state.idle = 1
            for k in range(stream.cells.shape[0]):
                stream.cells[k].tick = -1
        elif state.idle == 0 and _is_lost(state, piece):
            state.resyncs += 1
            state.idle = 1
        if state.idle != 0:
            _begin_at(state, piece)
            _lay(engine, piece)
            _enter(engine)
        else:
            _lay(engine, piece)
    return bool(state.idle == 0)


@njit()
def _come(engine: "Engine", tick: int, otherwise: float) -> float:
    # The sample of a tick to come, if it is there.
    cells = engine.stream.cells
    cell = cells[tick % cells.shape[0]]
    return cell.force if cell.tick == tick else otherwise


@njit()
def _faded(state: StreamState) -> float:
    # In place of a sample that is missing: the last one, held, then faded.
    since_s = (state.gap - 0.5) * state.period_ns * 1e-9
    return state.held * min(max((HOLD_S + FADE_S - since_s) / FADE_S, 0.0), 1.0)


@njit()
def _force_of(engine: "Engine") -> float:
    # The mean force of the tick that begins.
    state, cells = engine.stream.state[0], engine.stream.cells
    cell = cells[state.tick % cells.shape[0]]
    if cell.tick == state.tick:
        state.held = cell.force
        state.gap = 0
        return float(cell.force)
    if state.held == 0.0:
        return 0.0
    if state.gap == 0:
        state.underflows += 1
    state.gap += 1
    force = _faded(state)
    if force == 0.0:
        state.held = 0.0
    return force


@njit()
def _find_place(engine: "Engine") -> None:
    # Where the tick that begins pushes. What a contact's parabolas reach ahead of it is at the contact's place, and so
    # is the step in which that begins.
    state, cells = engine.stream.state[0], engine.stream.cells
    for tick in range(state.tick, state.tick + _LOOK + 2):
        cell = cells[tick % cells.shape[0]]
        if cell.tick == tick:
            state.x = cell.x
            state.y = cell.y
            return


@njit()
def _edge(s0: float, s1: float, s2: float, s3: float) -> float:
    return (7.0 * (s1 + s2) - (s0 + s3)) / 12.0


@njit()
def _enter(engine: "Engine") -> None:
    # The parabola of the tick that begins, from the end of the one before.
    state = engine.stream.state[0]
    state.entered = state.tick
    force = _force_of(engine)
    _find_place(engine)
    following = _come(engine, state.tick + 1, force)
    after = _come(engine, state.tick + 2, following)
    if state.tick < state.begin:
        state.before = state.mean = state.left = state.right = 0.0
        return
    if state.tick == state.begin:
        state.left = _edge(0.0, 0.0, force, following)
    else:
        state.left = state.right
    state.before = state.mean if state.tick > state.begin else 0.0
    state.mean = force
    state.right = _edge(state.before, force, following, after)
    if state.tick > state.newest and force == state.left == state.right == 0.0:
        state.idle = 1


@njit()
def _area(state: StreamState, x: float) -> float:
    # Of the parabola from the tick's begin to x (0..1), in ticks; at 1 it is the mean.
    rise = state.right - state.left
    bend = 6.0 * state.mean - 3.0 * (state.left + state.right)
    return x * (state.left + x * (0.5 * (rise + bend) - x * bend / 3.0))


@njit()
def _mean_over_step(engine: "Engine") -> tuple[float, float, float]:
    # The mean force over the next step of the mesh, and its place: that of the tick in which the step's middle lies.
    # Its ends often fall on those of ticks, where a nanosecond would decide.
    state = engine.stream.state[0]
    rest, total = state.ticks_per_step, 0.0
    x, y = state.x, state.y
    while rest >= 1.0 - state.inside:
        total += state.mean - _area(state, state.inside)
        rest -= 1.0 - state.inside
        state.inside = 0.0
        state.tick += 1
        _enter(engine)
        if rest > 0.5 * state.ticks_per_step:
            x, y = state.x, state.y
    reached = state.inside + rest
    total += _area(state, reached) - _area(state, state.inside)
    state.inside = reached
    return total / state.ticks_per_step, x, y


@only_with("stream", otherwise=0)
def apply_streamed_force(engine: "Engine") -> int:
    """List this step's force in engine.forces; returns whether the stream sounds: 1 or 0."""
    state = engine.stream.state[0]
    if state.idle != 0:
        return 0
    force, x, y = _mean_over_step(engine)
    if force != 0.0:
        push(engine, x, y, force)
        composition.struck(engine, x, y, force)  # nobody knows yet what the contact's impulse will be
    return 1
