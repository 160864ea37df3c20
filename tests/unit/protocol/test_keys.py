"""Keys of a rig: all below drumstick/<rig>/, each name once, and no rig name that would reach outside."""

import pytest

from protocol.keys import Keys


def test_every_key_lies_below_the_rig_and_is_its_own() -> None:
    keys = Keys("stage-left")
    names = [name for name, member in vars(Keys).items() if isinstance(member, property)]
    made = [getattr(keys, name) for name in names]
    made += [keys.set_one("m"), keys.param("m"), keys.alive("sound", "1")]
    assert len(set(made)) == len(made) >= 12
    assert all(key.startswith("drumstick/stage-left/") for key in made)
    assert keys.set_one("k_coll") == "drumstick/stage-left/set/k_coll"


@pytest.mark.parametrize("rig", ["", "a/b", "*", "**", "a b", "a$", "x" * 41, "ü", "a\n"])
def test_a_name_that_cannot_stand_in_a_key(rig: str) -> None:
    with pytest.raises(ValueError, match="letters, digits"):
        Keys(rig)
