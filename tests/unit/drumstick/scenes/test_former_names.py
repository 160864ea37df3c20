"""An effect of the drum that was called otherwise once: read all the same, noted, shown by its present name."""

import json

import numpy as np
import pytest

from drumstick.drum.effects.registry import DRUM_TABLES, FORMER_NAMES
from drumstick.drum.effects.uniform_loss import UniformLossTable
from drumstick.drum.memory.strikes import OfflineStrike
from drumstick.drum.render import render
from drumstick.scenes.former_names import with_present_names
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse

SOURCE = "stage/a.toml"
NOTE = "drum.effects.air_loss: is called uniform_loss now; the old name is still read for a while: rename it there"
# text with the old name -> the line that the note names
FORMS = {
    "a header": ("[drum]\nt60_s = 2.0\n\n[drum.effects.air_loss] # air_loss\nt60_s = 0.5 # air_loss\n", 4),
    "a header in quotes": ('[drum.effects."air_loss"]\nt60_s = 0.5\n', 1),
    "dotted": ("[drum]\neffects.air_loss.t60_s = 0.5\n", 2),
    "beside another": ("[drum.effects.rim]\n[drum.effects]\nair_loss.t60_s = 0.5\n", 3),
    "in braces": ("\n[drum]\neffects = { rim = {}, air_loss = { t60_s = 0.5 } }\n", 3),
    "in braces within braces": ("\ndrum = { effects = { air_loss = { t60_s = 0.5 } } }\n", 2),
    "with the line ends of Windows": ("[drum]\r\n[drum.effects.air_loss]\r\nt60_s = 0.5\r\n", 2),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_old_name_is_read_as_the_new_one_and_noted(form: str) -> None:
    text, line = FORMS[form]
    notes: list[str] = []
    scene = parse(text, SOURCE, notes)
    assert scene.drum.effects["uniform_loss"] == UniformLossTable(0.5)
    assert notes == [f"{SOURCE}:{line}: {NOTE}"]
    assert parse(text, SOURCE) == scene


@pytest.mark.parametrize("form", FORMS)
def test_its_text_is_shown_with_the_new_name_and_otherwise_as_it_is(form: str) -> None:
    text, line = FORMS[form]
    shown = with_present_names(text)
    notes: list[str] = []
    assert parse(shown, SOURCE, notes) == parse(text, SOURCE)
    assert notes == []
    changed = [
        at
        for at, pair in enumerate(zip(text.split("\n"), shown.split("\n"), strict=True), 1)
        if len(set(pair)) > 1
    ]
    assert line in changed
    assert shown.replace("uniform_loss", "air_loss") == text
    assert with_present_names(shown) == shown


def test_words_that_only_look_like_it_stay() -> None:
    text = 'words = "no air_loss"\n[hand]\n# air_loss\n[drum.effects.uniform_loss]\n'
    assert with_present_names(text) == text
    assert with_present_names("") == ""
    old = 'words = "an air_loss"\n# air_loss\n[drum.effects.air_loss]\n'
    assert with_present_names(old) == 'words = "an air_loss"\n# air_loss\n[drum.effects.uniform_loss]\n'


def test_both_names_in_one_scene_are_refused_and_which_to_delete_is_said() -> None:
    new, old = "[drum.effects.uniform_loss]\nt60_s = 0.5\n", "[drum.effects.air_loss]\nt60_s = 0.5\n"
    for text, line in ((new + old, 3), (old + new, 1)):
        with pytest.raises(SceneError) as refused:
            parse(text, SOURCE)
        assert refused.value.mistakes == [
            f"{SOURCE}:{line}: drum.effects.air_loss: is the old name of uniform_loss, which is here too: "
            "delete [drum.effects.air_loss]"
        ]


def test_a_mistake_under_the_old_name_has_its_line() -> None:
    with pytest.raises(SceneError) as refused:
        parse("[drum.effects.air_loss]\nt60_s = 99.0\n", SOURCE)
    assert refused.value.mistakes == [
        f"{SOURCE}:2: drum.effects.air_loss.t60_s: 99.0 s is outside 0.02 .. 60 s"
    ]


def test_the_old_name_is_none_of_the_known_ones() -> None:
    with pytest.raises(SceneError, match=r"known: .*uniform_loss") as refused:
        parse("[drum.effects.loss]\n", SOURCE)
    assert "air_loss" not in str(refused.value)
    with pytest.raises(SceneError, match=r"effects\.air_loss: unknown effect"):
        parse("[effects.air_loss]\n", SOURCE)  # the stick never had one


def test_tables_from_before_are_read_and_those_of_now_have_the_new_name() -> None:
    """Names in a recording, or in answers of a rig of an older version."""
    scene = parse("[drum.effects.air_loss]\nt60_s = 0.5\n", SOURCE)
    tables = json.loads(json.dumps(as_tables(scene)))
    assert list(tables["drum"]["effects"]) == ["uniform_loss"]
    tables["drum"]["effects"] = {"air_loss": {"t60_s": 0.5}}
    assert from_tables(tables) == scene
    tables["drum"]["effects"] = {"air_loss": {"t60_s": 0.5}, "uniform_loss": {"t60_s": 0.5}}
    with pytest.raises(SceneError, match="delete"):
        from_tables(tables)


@pytest.mark.parametrize("renderer", ["[mesh]\naccuracy = 'draft'\n", "[modal]\ntop_Hz = 2000\n"])
def test_it_sounds_the_same_to_the_bit(renderer: str) -> None:
    def sound(effect: str) -> bytes:
        scene = parse(f"{renderer}[drum.effects.{effect}]\nt60_s = 0.3\n", SOURCE)
        found = render(scene, [OfflineStrike(0.0, 0.3, 0.0, 10.0, 0.005)], 0.2, 48_000)
        assert np.abs(found).max() > 0.0
        return found.tobytes()

    assert sound("air_loss") == sound("uniform_loss")
    assert sound("rim") != sound("uniform_loss")


def test_no_old_name_is_given_away_anew() -> None:
    assert not set(FORMER_NAMES) & set(DRUM_TABLES)
