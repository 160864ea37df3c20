"""`[mallet]`: a material's numbers, those given in their place, and what is refused."""

import dataclasses

import pytest

from drumstick.parameters.declare import quantities
from drumstick.parameters.mallet import MATERIALS, Mallet
from drumstick.scenes.scene_text import SceneError, as_tables, from_tables, parse

STRUCK = '[drum]\nexcitation = "mallet"\n'


def test_a_drum_that_is_struck_by_a_mallet_has_one_of_wood() -> None:
    assert parse(STRUCK, "a").mallet == Mallet() == Mallet(material="wood", **MATERIALS["wood"])
    assert parse("", "a").mallet is None


@pytest.mark.parametrize("material", MATERIALS)
def test_a_material_has_all_numbers_within_their_ranges(material: str) -> None:
    found = parse(f'{STRUCK}[mallet]\nmaterial = "{material}"\n', "a").mallet
    assert found == Mallet(material=material, **MATERIALS[material])  # type: ignore[arg-type]
    declared = quantities(Mallet)
    assert set(MATERIALS[material]) == set(declared) - {"material"}
    for key, value in MATERIALS[material].items():
        assert declared[key].low <= value <= declared[key].high


def test_what_is_given_stands_in_the_place_of_the_materials() -> None:
    scene = parse(f'{STRUCK}[mallet]\nmaterial = "felt"\nmass_kg = 0.1\nloss_s_per_m = 0\n', "a")
    assert scene.mallet is not None
    wanted = {**MATERIALS["felt"], "mass_kg": 0.1, "loss_s_per_m": 0.0}
    assert dataclasses.asdict(scene.mallet) == {"material": "felt", **wanted}
    assert from_tables(as_tables(scene)) == scene


def test_a_mallet_that_nothing_swings_is_refused() -> None:
    with pytest.raises(SceneError) as refused:
        parse("[mallet]\nmass_kg = 0.02\n", "a.toml")
    assert refused.value.mistakes == [
        "a.toml:1: mallet: needs [drum] excitation = \"mallet\", and it is 'analytic': set it, or leave [mallet] out"
    ]


def test_a_mallet_strikes_modes_too() -> None:
    assert parse(f"{STRUCK}[modal]\n", "a").mallet == Mallet()


def test_tables_that_name_a_material_only_have_its_numbers() -> None:
    found = from_tables({"drum": {"excitation": "mallet"}, "mallet": {"material": "felt"}}).mallet
    assert found == Mallet(material="felt", **MATERIALS["felt"])
