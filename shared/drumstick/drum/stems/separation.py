"""Taking single pickups or microphones out of a drum's mix, into output pairs of their own. Allocates; any thread."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from drumstick.drum.effects.building import Separation
from drumstick.drum.effects.registry import EFFECTS
from drumstick.drum.engine import Control, Engine
from drumstick.drum.membrane.heads import aligned, panned
from drumstick.drum.memory.pickup_fade import with_fade
from drumstick.drum.memory.stems import Stems
from drumstick.drum.modal.air_on_mesh import moved_by_each
from drumstick.drum.output.upsample import TAPS
from drumstick.drum.tiers import coefficients_of
from drumstick.parameters.scene import Scene
from realtime.records import ABSENT, is_there

REST = "rest"  # what no pickup hears: a hoop that is struck
Numbers = npt.NDArray[np.float64]


def source_names(scene: Scene) -> tuple[str, ...]:
    """Names of what the scene's drum is heard by, in the order of its file: microphone-1 ..., or pickup-1 ...

    >>> from drumstick.parameters.scene import Scene
    >>> source_names(Scene("two pickups"))
    ('pickup-1', 'pickup-2')
    """
    kind, found = (
        ("microphone", scene.listen.microphones)
        if scene.listen.microphones
        else ("pickup", scene.listen.pickups)
    )
    return tuple(f"{kind}-{number}" for number in range(1, len(found) + 1))


def has_rest(scene: Scene) -> bool:
    """True for a drum of which something sounds beside what pickups or microphones hear."""
    return any(hasattr(EFFECTS[name], "added_output") for name in scene.drum.effects)


def separated(engine: Engine, scene: Scene, names: Sequence[str]) -> Engine:
    """`engine`, of this (fitted) scene and at rest, whose blocks have 2 + 2 S channels: the mix without the sources of
    these names, then a pair for each. They share its memory: play only one of the two. Raises ValueError for a name
    that the scene has not.
    """
    if not names:
        return engine
    there = source_names(scene)
    for name in names:
        if name not in there:
            raise ValueError(f"{scene.name} has no {name}; it has {', '.join(there)}")
    taken = [there.index(name) for name in names]
    apart = listening_by(engine, scene, taken)
    return with_fade(apart, taken) if is_there(engine.pickup_fade) else apart


def listening_by(engine: Engine, scene: Scene, taken: Sequence[int]) -> Engine:
    """`engine` with the sources of these numbers in pairs of their own; the scene's places count in a bank, in a mesh
    those of the engine."""
    control: Control = engine.control[0]
    step_s = float(control["divisor"]) / float(control["rate_Hz"])
    pans = np.array([panned(pan) for *_, pan in scene.listen.microphones or scene.listen.pickups])
    separation = Separation(taken, pans, np.zeros((0, 0)))
    if is_there(engine.modal):
        return _of_bank(engine, scene, separation, step_s)
    return _of_mesh(engine, scene, separation, step_s)


def _nothing(channels: int) -> Stems:
    none, no_modes = np.zeros((0, channels)), np.zeros((0, 0), np.float32)
    now, history = np.zeros(channels), aligned((channels, 2 * TAPS))
    return Stems(none, none, none, np.zeros((channels, 0)), no_modes, no_modes, now, history)


def _of_mesh(engine: Engine, scene: Scene, separation: Separation, step_s: float) -> Engine:
    gains: dict[str, Any] = {}
    if is_there(engine.microphones):
        gains["microphones"], kept = separation.of_corners(engine.microphones.gains)
        engine = engine._replace(microphones=engine.microphones._replace(gains=kept))
    gains["pickups"], kept_corners = separation.of_corners(engine.pickup_gains)
    engine = engine._replace(pickup_gains=kept_corners)
    moved = moved_by_each(
        scene, float(engine.head.grid["spacing"][0]), coefficients_of(scene, step_s), step_s
    )
    effects: Any = engine.effects
    for name, module in EFFECTS.items():
        part = getattr(effects, name, None)
        if is_there(part) and hasattr(module, "separated"):
            left, found = module.separated(part, separation._replace(moved=moved))
            effects, gains = effects._replace(**{name: left}), gains | found
    return engine._replace(effects=effects, stems=_nothing(2 * len(separation.taken))._replace(**gains))


def _of_bank(engine: Engine, scene: Scene, separation: Separation, step_s: float) -> Engine:
    # Step by step: a block of steps knows of two channels only.
    from drumstick.drum.modal.building import gains_of_each

    bank, stems = engine.modal, _nothing(2 * len(separation.taken))

    def laid(each: Numbers) -> list[npt.NDArray[np.float32]]:
        more = (0, 0), (0, len(bank.q) - each.shape[1])
        return [np.pad(gains, more).astype(np.float32) for gains in separation.split(each)]

    moving, still = gains_of_each(scene, step_s)
    own, (left, right) = laid(moving)
    stems, bank = stems._replace(movement=own), bank._replace(left=left.copy(), right=right.copy())
    if still is not None:
        own, (left, right) = laid(still)
        stems = stems._replace(place=own)
        bank = bank._replace(left_by_displacement=left.copy(), right_by_displacement=right.copy())
    return engine._replace(modal=bank, blocks=ABSENT, stems=stems)
