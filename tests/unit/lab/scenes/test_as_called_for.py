"""A scene without an effect is the instrument without that effect's module: the same bytes, the same machine code."""

import dataclasses
from pathlib import Path

import pytest

from drumstick.drum.effects.rim import RimTable
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.benchmarks.scenes import as_called_for
from drumstick_lab.pages.measured.measured_scenes import CALLED_FROM_PYTHON


@pytest.mark.long
@pytest.mark.parametrize("name", ["bare-drum", "snare"])
def test_a_scene_is_as_if_no_other_effect_were_installed(name: str) -> None:
    found = as_called_for.both(name)
    assert found["same_strikes"]
    assert found["same_sound"]
    assert found["same_memory"]
    assert found["only_in_whole"] == found["only_in_bare"] == []
    assert set(found["other_code"]) <= CALLED_FROM_PYTHON


def test_the_smaller_library_has_what_the_scene_names_and_no_more(tmp_path: Path) -> None:
    scene = parse(shipped_text("roll"), "roll")
    drum = dataclasses.replace(scene.drum, effects={"rim": RimTable()})
    shared = as_called_for.library_with(dataclasses.replace(scene, drum=drum), tmp_path)
    texts = [
        (shared / "drumstick" / part / "effects" / "registry.py").read_text() for part in ("drum", "stick")
    ]
    assert "    rim,\n" in texts[0]
    assert "    pulse,\n" in texts[1]
    for part, text in zip(("drum", "stick"), texts, strict=True):
        compile(text, part, "exec")
        gone = set(as_called_for.PARTS[part]) - {"rim", "pulse"}
        assert not [name for name in gone if f"    {name},\n" in text]
