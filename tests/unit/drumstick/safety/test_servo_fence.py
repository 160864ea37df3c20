"""The servo's own fence by itself: a number outside its row is refused here, whatever the envelope says of it."""

import dataclasses
import math

import numpy as np
import pytest

from drumstick.drum.effects.registry import DRUM_TABLES
from drumstick.parameters.declare import live_quantities
from drumstick.parameters.scene import Scene
from drumstick.safety.fence import fence_of, within
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick.stick.law import Records, law_of


def scene_of(name: str) -> Scene:
    return parse(shipped_text(name), name)


def passes(scene: Scene, law: Records) -> bool:
    return within(fence_of(scene), law.view(np.int64), law.view(np.float64))


@pytest.mark.parametrize("name", shipped_names())
def test_a_scenes_own_law_passes(name: str) -> None:
    scene = scene_of(name)
    assert passes(scene, law_of(scene))


@pytest.mark.parametrize("name", shipped_names())
def test_what_the_wire_may_set_has_the_tables_range_and_nothing_else_a_range(name: str) -> None:
    scene = scene_of(name)
    tables = [scene.stick, scene.drum, *scene.effects.values(), *scene.drum.effects.values(), scene.listen]
    tables += [] if scene.mallet is None else [scene.mallet]
    live = [q for table in tables for q in live_quantities(table).values()]
    fence = fence_of(scene)
    ranges = [(low, high) for is_live, low, high, _ in fence.tolist() if is_live]
    assert sorted(ranges) == sorted((q.low, q.high) for q in live)
    assert len(fence) * 8 == law_of(scene).dtype.itemsize


@pytest.mark.parametrize("name", shipped_names())
def test_each_number_passes_up_to_its_limits_and_no_further(name: str) -> None:
    scene = scene_of(name)
    fence, own = fence_of(scene), law_of(scene)
    for at in np.flatnonzero(fence["live"]):
        low, high = float(fence["low"][at]), float(fence["high"][at])
        for value in (low, high):
            law = own.copy()
            law.view(np.float64)[at] = value
            assert passes(scene, law)
        for value in (math.nextafter(low, -math.inf), math.nextafter(high, math.inf), math.nan):
            law = own.copy()
            law.view(np.float64)[at] = value
            assert not passes(scene, law)


@pytest.mark.parametrize("name", shipped_names())
def test_each_other_word_is_the_scenes_bit_by_bit(name: str) -> None:
    scene = scene_of(name)
    fence, own = fence_of(scene), law_of(scene)
    for at in np.flatnonzero(fence["live"] == 0):
        for bit in (0, 1, 40, 62):
            law = own.copy()
            law.view(np.int64)[at] ^= 1 << bit
            assert not passes(scene, law)


def test_a_law_of_a_drum_with_other_live_values_is_refused() -> None:
    """Both have as many, and the same numbers in the same places: one opens a strainer, the other presses a muffle."""
    shipped = scene_of("snare")

    def with_only(name: str) -> Scene:
        effects = {"cavity": shipped.drum.effects["cavity"], name: DRUM_TABLES[name]()}
        return dataclasses.replace(shipped, drum=dataclasses.replace(shipped.drum, effects=effects))

    scene, other = with_only("snare"), with_only("muffle")
    law, others = law_of(scene), law_of(other)
    assert law.dtype == others.dtype
    others["drum"] = law["drum"]
    assert passes(scene, law)
    assert not passes(scene, others)
    assert passes(other, others)
