"""Heads to be measured: the engine that plays, and the same lattice stepped plainly in float64. Any thread."""

import dataclasses
from typing import Literal, NamedTuple

import numpy as np

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.calibrate import full_scale
from drumstick.drum.engine import Control, Engine
from drumstick.drum.membrane.lattice import Lattice
from drumstick.drum.membrane.scheme import Scheme, tuned
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.tiers import coefficients_of, divisor_for
from drumstick.parameters.drum import Mesh
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.drums.modes import Numbers, Step, decay_error, measured, patterns_of
from drumstick_lab.accuracy.drums.plain_mesh import PlainMesh, plain_mesh, plain_steps
from drumstick_lab.accuracy.timing import Window, spent_ns

DEVICE_RATE_Hz = 48_000
BLOCK = 128
Rim = Literal["weights", "none"]
_UPDATES = 4e6  # of junctions in a window: a millisecond or less
_MIN_FRAMES, _MAX_FRAMES = 256, 8192
_QUIET = 1e-6  # of full scale: the limiter stays out of it

# What the scene's [mesh] says for each scheme.
SCHEMES: dict[str, Mesh] = {
    "limit": Mesh(),
    "lossless": Mesh(courant="lossless"),
    "rectilinear": Mesh(topology="rectilinear"),
    "fourth": Mesh(accuracy="fine"),
}


class HeadAt(NamedTuple):
    """One head: its scene, its lattice, and what a step of it is made of."""

    scene: Scene
    lattice: Lattice
    scheme: Scheme
    step_s: float
    engine: Engine
    strikes: StrikeRing
    plain: PlainMesh


def head_at(scheme: str, rim: Rim, divisor: int) -> HeadAt:
    """The default drum, a step every `divisor` samples of the device.

    rim "none" is the staircase: every junction inside weighs 1 / neighbours, wherever the rim passes beside it.
    """
    asked = dataclasses.replace(SCHEMES[scheme], rate_Hz=DEVICE_RATE_Hz / divisor, cpu_budget=0.95)
    return _head_of(dataclasses.replace(Scene("drum"), mesh=asked), rim, divisor)


def _head_of(scene: Scene, rim: Rim, divisor: int) -> HeadAt:
    step_s = divisor / DEVICE_RATE_Hz
    numbers = coefficients_of(scene, step_s)
    lattice = tuned(scene.drum.f01_Hz, step_s, numbers.scheme, numbers.losses)
    if rim == "none":
        even = np.where(lattice.weights > 0.0, 1.0 / lattice.topology.neighbours, 0.0)
        lattice = dataclasses.replace(lattice, weights=even)
    strikes = StrikeRing()
    engine = new_engine(scene, DEVICE_RATE_Hz, strikes)
    control: Control = engine.control[0]
    if int(control["divisor"]) != divisor:
        raise ValueError(f"the mesh takes {control['divisor']} samples a step, not {divisor}")
    engine.head.weights[:] = (numbers.weight_scale * lattice.weights).ravel()
    control["output_gain"] = _QUIET / full_scale(scene).peak_N
    beside = plain_mesh(lattice, numbers.scheme, numbers.losses)
    return HeadAt(scene, lattice, numbers.scheme, step_s, engine, strikes, beside)


def played_step(head: HeadAt) -> Step:
    """The very kernel that plays, one step of it at a time."""
    engine = head.engine
    control: Control = engine.control[0]
    places = np.flatnonzero(head.lattice.weights)
    out = np.zeros((int(control["divisor"]), 2), np.float32)

    def step(u: Numbers, before: Numbers) -> Numbers:
        time_levels, at = engine.head.time_levels, int(control["present_level"])
        time_levels[:] = 0.0
        time_levels[at][places], time_levels[1 - at][places] = u, before
        control["asleep"], control["phase"] = 0, 0
        render_all(engine, out, len(out), 0)
        found = time_levels[int(control["present_level"])][places].astype(np.float64)
        time_levels[:] = 0.0
        return found

    return step


def plain_step(head: HeadAt) -> Step:
    """Plain form of the step in float64."""
    mesh, places = head.plain, np.flatnonzero(head.lattice.weights)

    def step(u: Numbers, before: Numbers) -> Numbers:
        mesh.time_levels[:] = 0.0
        mesh.time_levels[0][places], mesh.time_levels[1][places] = u, before
        plain_steps(mesh, 0, 1)
        return mesh.time_levels[1][places]

    return step


def decay_off(scene: Scene) -> float:
    """Relative error of T60 of the scene's drum on its mesh, of the mode of its lowest twenty that is farthest off; the
    scene names no effect. scipy finds the modes."""
    head = _head_of(scene, "weights", divisor_for(scene, DEVICE_RATE_Hz))
    poles = measured(played_step(head), patterns_of(head.lattice), head.step_s)
    return decay_error(poles.t60_s, scene.drum.t60_s)


def _frames(updates_a_frame: float) -> int:
    return int(np.clip(_UPDATES / updates_a_frame, _MIN_FRAMES, _MAX_FRAMES)) // BLOCK * BLOCK


def sounding(scene: Scene, engine: Engine, strikes: StrikeRing, updates_a_frame: float) -> Window:
    """ns of a sample at the device's rate of a drum that rings and is struck once a window: upsampling included."""
    blow = full_scale(scene)
    out = np.zeros((_frames(updates_a_frame), 2), np.float32)

    def window() -> float:
        strikes.push_blow(blow)
        return spent_ns(lambda: render_all(engine, out, BLOCK, 0)) / len(out)

    return window


def played_window(head: HeadAt) -> Window:
    """`sounding` of this head."""
    control: Control = head.engine.control[0]
    return sounding(head.scene, head.engine, head.strikes, head.lattice.junctions / int(control["divisor"]))


def plain_window(head: HeadAt) -> Window:
    """ns of a sample at the device's rate of the plain step alone: nothing is struck, heard or upsampled."""
    divisor = head.step_s * DEVICE_RATE_Hz
    steps = max(2, round(_frames(head.lattice.junctions / divisor) / divisor))
    inside = np.flatnonzero(head.lattice.weights)
    noise = np.random.default_rng(1).standard_normal((2, len(inside)))
    head.plain.time_levels[:, inside] = noise

    def window() -> float:
        return spent_ns(lambda: plain_steps(head.plain, 0, steps)) / (steps * divisor)

    return window
