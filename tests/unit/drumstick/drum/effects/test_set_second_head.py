"""Pitch of the second head as a live value: the drum that is built for it has it, and its first head stays."""

import math
from typing import Literal

import numpy as np
import pytest

from drumstick.drum.build import new_engine
from drumstick.drum.effects.cavity import CavityTable
from drumstick.drum.effects.registry import DRUM_TABLES
from drumstick.drum.engine import Engine
from drumstick.drum.membrane.lattice import J01
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.rebuilt import rebuilt_values, scene_rebuilt
from drumstick.parameters.drum import Drum, Mesh
from drumstick.parameters.scene import Scene
from drumstick.safety.fence import fence_of, within
from drumstick.scenes.drum_values import require_drum
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick.scenes.table import Refusal, scene_values, scene_with, table_of
from drumstick.stick.law import law_of
from membranes import second_head

RATE_HZ = 48_000
NAME = "cavity.f01"
Accuracy = Literal["standard", "fine"]


def _scene(f01_Hz: float = 180.0, *others: str, accuracy: Accuracy = "standard") -> Scene:
    effects = {name: DRUM_TABLES[name]() for name in others} | {"cavity": CavityTable(f01_Hz=f01_Hz)}
    return Scene("two heads", drum=Drum(f01_Hz=150.0, effects=effects), mesh=Mesh(accuracy=accuracy))


def _engine(scene: Scene) -> Engine:
    return new_engine(scene, RATE_HZ, StrikeRing())


def _second_pitch(engine: Engine) -> float:
    """Lowest mode of the second head alone, Hz: from its area in junctions and what a step adds."""
    _, tau, order_4, _, _ = second_head(engine.effects.cavity)
    area = 1.0 / float(engine.effects.cavity.state[0]["per_area_2"])
    a = J01**2 * math.pi / (4.0 * area * math.sqrt(0.75))
    step_s = float(engine.control[0]["divisor"]) / RATE_HZ
    return math.asin(math.sqrt(tau * a - order_4 * a * a) / 2.0) / (math.pi * step_s)


@pytest.mark.parametrize("accuracy", ["standard", "fine"])
@pytest.mark.parametrize("others", [(), ("snare",), ("tension",)])
def test_the_drum_that_is_built_has_the_second_head_that_was_set(
    accuracy: Accuracy, others: tuple[str, ...]
) -> None:
    scene = _scene(180.0, *others, accuracy=accuracy)
    before, after = _engine(scene), _engine(scene_rebuilt(scene, {NAME: 320.0}))
    assert _second_pitch(before) == pytest.approx(180.0, rel=0.005)
    assert _second_pitch(after) == pytest.approx(320.0, rel=0.005)
    assert np.array_equal(after.head.weights, before.head.weights)
    said = _engine(_scene(320.0, *others, accuracy=accuracy)).effects.cavity
    assert np.array_equal(after.effects.cavity.head.weights, said.head.weights)
    assert np.array_equal(after.effects.cavity.pickups, said.pickups)


def test_it_is_a_parameter_of_each_scene_with_a_second_head_and_of_no_other() -> None:
    offered = {name: NAME in table_of(parse(shipped_text(name), name)) for name in shipped_names()}
    assert [name for name, is_there in offered.items() if is_there] == ["cross-stick", "snare", "tom"]
    plain = Scene("plain")
    assert scene_rebuilt(plain, {NAME: 300.0}) == plain
    with pytest.raises(Refusal, match=r"cavity\.f01: no such parameter in this scene"):
        scene_with(plain, {NAME: 300.0})


def test_a_set_is_the_scene_that_says_so_and_stays_within_its_limits() -> None:
    scene = _scene(180.0)
    row = table_of(scene)[NAME]
    assert row.quantity.rebuilds
    assert row.from_norm(row.norm(180.0)) == pytest.approx(180.0)
    assert row.from_norm(0.5) == pytest.approx(200.0)
    assert (scene_values(scene)[NAME], rebuilt_values(scene)[NAME]) == (180.0, 180.0)
    assert scene_with(scene, {NAME: 320.0}) == scene_rebuilt(scene, {NAME: 320.0}) == _scene(320.0)
    for value in (0.0, 19.0, 2001.0):
        with pytest.raises(Refusal, match=rf"cavity\.f01: {value:g} Hz is outside 20 \.\. 2000 Hz"):
            scene_with(scene, {NAME: value})
    law = law_of(scene)
    assert within(fence_of(scene), law.view(np.int64), law.view(np.float64))


def test_a_second_head_far_below_the_first_is_refused_since_its_mesh_would_be_too_large() -> None:
    scene = _scene(180.0)
    assert scene_with(scene, {NAME: 75.0}) == _scene(75.0)
    for values in ({NAME: 74.0}, {"drum.f01": 361.0}):
        with pytest.raises(Refusal, match=r"cavity\.f01_Hz .* is less than half of drum\.f01_Hz"):
            require_drum(scene, values)
