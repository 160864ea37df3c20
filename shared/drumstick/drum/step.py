"""One step of the drum: forces in, heads forward, pickups out. Audio thread; no allocation, no locks.

What the scene does not name is not compiled: see drumstick.drum.effects.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects import composition
from drumstick.drum.engine import Control, Engine
from drumstick.drum.excitation.analytic import apply_forces, forces_ahead
from drumstick.drum.mallets import in_touch, mallet, on_mesh, on_modes, under_tension
from drumstick.drum.membrane.sweep import largest, sweep, take_laplacian
from drumstick.drum.membrane.terms import Terms
from drumstick.drum.memory.pulses import JunctionForce
from drumstick.drum.modal import apart, bank, blocks, held
from drumstick.drum.output import microphones, stems
from drumstick.drum.pickups import fade
from drumstick.drum.threads.shared_sweep import swept
from realtime.kernels.jit import njit, only_with

Floats = npt.NDArray[np.float32]
_REST = 1e-9  # of the loudest displacement: 180 dB down the head counts as at rest
_LOOK_EVERY = 4096  # steps between looks at whether the head has come to rest


@njit()
def _number(push: Any) -> float:
    if push is None:  # decided by the type, at compile time
        return 0.0
    return float(push)


@njit()
def _pull(engine: Engine, u: Floats, u_old: Floats) -> float:
    # q: by how much the tension is raised in this step.
    push = _number(composition.head_push(engine))
    return composition.tightened(engine, u, u_old, push) + under_tension.pull_change_by_mallets(
        engine, u, u_old, push
    )


@njit()
def _gains_of_fourth(control: Control, momentum: Any, tightness: np.float32) -> tuple[np.float32, np.float32]:
    # Of A u and of `extra`: with momentum what the tension adds to A u stands apart, for eta leaves it out.
    if momentum is None:  # decided by the type, at compile time
        return control.order_2 + tightness, control.u_gain
    return control.order_2, tightness


@only_with("laplacian", otherwise=0.0)
def _swept_fourth(engine: Engine, u: Floats, u_old: Floats) -> float:
    control: Control = engine.control[0]
    take_laplacian(engine.head, u, engine.laplacian)
    tightness = composition.tightness(engine, _pull(engine, u, u_old))
    momentum = composition.momentum(engine)
    laplacian_gain, extra_gain = _gains_of_fourth(control, momentum, tightness)
    terms = Terms(
        u_gain=laplacian_gain,
        u_old_gain=control.u_old_gain,
        neighbour_gain=control.order_4,
        push=composition.head_push(engine),
        momentum=momentum,
        rho=composition.rho(engine),
        eta=composition.eta(engine),
        extra=u,
        extra_gain=extra_gain,
        total=composition.asked_sum(engine),
    )
    return sweep(engine.head, engine.laplacian, u_old, terms)


@njit(inline=True)
def _swept(engine: Engine, u: Floats, u_old: Floats, laplacian: Any) -> float:
    # The first head's u+, into `u_old`; its sum where a second head asks for it.
    if laplacian is not None:  # decided by the type, at compile time
        return _swept_fourth(engine, u, u_old)
    return swept(engine, engine.shared_sweep, u, u_old, _pull(engine, u, u_old))


@njit()
def _struck(engine: Engine, u_new: Floats) -> float:
    # Forces move u+; returns by how much its sum changed.
    forces, changed = engine.forces, 0.0
    for i in range(engine.control[0].forces):
        force: JunctionForce = forces[i]
        u_new[force.junction] += np.float32(force.step)
        composition.pushed(engine, force.junction, force.step)
        changed += force.step
    return changed


@only_with("head", otherwise=0.0)
def _largest(engine: Engine) -> float:
    return float(max(largest(engine.head.time_levels[0]), largest(engine.head.time_levels[1])))


@only_with("head")
def _reset_head(engine: Engine) -> None:
    engine.head.time_levels[:] = np.float32(0.0)
    microphones.reset(engine)


@njit()
def wake(engine: Engine) -> None:
    """Compute the head again: something is about to push it."""
    composition.resume(engine)
    held.take_up(engine)
    engine.control[0].asleep = 0


@njit()
def _fall_asleep(engine: Engine) -> None:
    # A head at rest is set to exactly 0 and not computed until the next strike. It also keeps denormals out on
    # processors where the float mode cannot.
    control: Control = engine.control[0]
    top = _largest(engine) + bank.largest(engine)
    control.loudest = max(control.loudest, top)
    if top <= _REST * control.loudest:
        _reset_head(engine)
        bank.reset(engine)
        composition.reset(engine)
        control.loudest = 0.0
        control.asleep = 1


@only_with("head", otherwise=(0.0, 0.0))
def _meshed(engine: Engine) -> Any:
    # One step of the mesh, and what the pickups hear: the velocity u+ - u, which has no constant part.
    control = engine.control[0]
    time_levels = engine.head.time_levels
    u, u_old = time_levels[control.present_level], time_levels[1 - control.present_level]
    composition.before_sweep(engine, u_old)
    on_mesh.start_due_mallets(engine, u, u_old)
    total = _swept(engine, u, u_old, engine.laplacian)
    u_new = u_old  # the sweep has put u+ in the place of u-
    total += _struck(engine, u_new)
    total += composition.after_sweep(engine, u_new)
    total += on_mesh.strike(engine, u_new)
    composition.sweep_beside(engine, control.present_level, total)
    composition.second_moved(engine, composition.on_second_head(engine, control.present_level))
    left, right = 0.0, 0.0
    besides = composition.picked_up(engine, control.present_level)
    for i in range(0, len(besides), 2):
        left += besides[i]
        right += besides[i + 1]
    from_air = microphones.captured(engine, u, u_new)
    left += from_air[0]
    right += from_air[1]
    for i in range(engine.pickups.shape[0]):
        moved = float(u_new[engine.pickups[i]] - u[engine.pickups[i]])
        left += engine.pickup_gains[i, 0] * moved
        right += engine.pickup_gains[i, 1] * moved
        stems.add_pickup(engine, i, moved)
    control.present_level = 1 - control.present_level
    return left, right


@only_with("blocks")
def _run_ahead(engine: Engine, most: int) -> None:
    # The coming steps of a bank at once, as many as nothing drives or couples. A look whether it rests ends them.
    if blocks.is_ahead(engine):
        return
    to_look = _LOOK_EVERY - engine.control[0].steps % _LOOK_EVERY
    alone = min(mallet.steps_alone(engine), fade.steps_between(engine), held.steps_between(engine))
    steps = min(most, to_look, alone, apart.steps_undriven(engine))
    if steps <= 0:
        apart.rejoin(engine)
    elif apart.is_under_tension(engine):
        apart.run(engine, steps)
    else:
        blocks.run(engine, forces_ahead(engine, steps), steps)


@njit()
def step(engine: Engine, ahead: int = 0) -> tuple[float, float]:
    """Take one step; returns what the pickups hear, left and right.

    ahead: how many steps, this one among them, have all the strikes that will ever fall into them; 0: not known.
    """
    control: Control = engine.control[0]
    fade.advance(engine)
    if held.follow(engine):
        mallet.lay_again(engine)
    _run_ahead(engine, ahead)
    active = apply_forces(engine) + mallet.playing(engine)
    on_modes.strike(engine)
    left, right = _meshed(engine)
    also_left, also_right = in_touch.step(engine)
    besides = composition.added_output(engine)
    control.steps += 1
    if active == 0 and control.steps % _LOOK_EVERY == 0:
        _fall_asleep(engine)
    return left + also_left + besides, right + also_right + besides
