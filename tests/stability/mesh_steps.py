"""A drum stepped by itself: the shipped step in a compiled loop, without interpolator, limiter and clock."""

import dataclasses
import math

import numpy as np

from drumstick.drum.build import new_engine
from drumstick.drum.engine import Engine
from drumstick.drum.excitation.analytic import begin
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.step import step
from drumstick.parameters.scene import Scene
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.float_mode import flush_denormals, restore
from realtime.kernels.jit import njit
from realtime.records import is_there

RATE = 48_000


@njit()
def _taken(engine: Engine, steps: int, flushes: bool) -> float:
    lent, top, mode = borrowed_view(engine), 0.0, 0
    if flushes:
        mode = flush_denormals()
    for _ in range(steps):
        left, right = step(lent)
        top = max(top, abs(left), abs(right))
    if flushes:
        restore(mode)
    return top


def take(engine: Engine, steps: int, flushes: bool = True) -> float:
    """So many steps, in the audio float mode if it `flushes`; the largest thing that the pickups have heard."""
    return _taken(engine, steps, flushes)


def drum_of(
    effects: dict[str, object],
    t60_s: float = math.inf,
    f01_Hz: float = 600.0,
    mesh: dict[str, object] | None = None,
    **drum: object,
) -> Scene:
    """A drum, small if nothing else is asked, without losses of its own unless `t60_s` is given."""
    scene = Scene("drum")
    changed = dataclasses.replace(scene.drum, effects=effects, t60_s=t60_s, f01_Hz=f01_Hz, **drum)
    return dataclasses.replace(scene, drum=changed, mesh=dataclasses.replace(scene.mesh, **(mesh or {})))


def engine_of(scene: Scene, presses: bool = True) -> Engine:
    """Its engine at rest and awake; a glide that is at its most from a stretch of 1 on; wires pressed on by so much
    that blows of some newtons lift them off, if it `presses`, else as the scene has it."""
    engine = new_engine(scene, RATE, StrikeRing())
    engine.control["asleep"] = 0
    if is_there(engine.effects.tension):
        engine.effects.tension.state["kappa"] = engine.effects.tension.state["q_most"]
    if is_there(engine.effects.snare) and presses:
        engine.effects.snare.state["eta_0"] = 0.01
    return engine


def strike(
    engine: Engine, peak_N: float, x: float = 0.3, y: float = 0.2, steps: float = 6.0, age: float = 0.0
) -> None:
    """A blow from the next step on, as long as so many steps, of which `age` are over."""
    engine.control["begun"] = begin(engine.pulses, int(engine.control["begun"][0]), x, y, age, steps, peak_N)
    engine.control["asleep"] = 0


def height(engine: Engine) -> float:
    """The largest displacement of the first head."""
    return float(np.abs(engine.head.time_levels).max())
