"""`[hand.human]` as it is written, read and refused."""

import pytest

import drumstick as ds
from drumstick.parameters.rig import Human
from drumstick.scenes.scene_text import as_tables, from_tables, shipped_names
from drumstick.scenes.writing import as_toml

PULSE = "[effects.pulse]\ndv_m_per_s = 0.2\n"
HUMAN = "[hand.human]\ninterval_percent = 3.0\nlevel_dB = 1.0\n"


def test_it_is_read_and_written_as_a_table_of_the_hand() -> None:
    scene = ds.scene(PULSE + HUMAN + "seed = 5\n")
    assert scene.hand.human == Human(3.0, 1.0, 5)
    assert not scene.hand_moves_stick  # it follows no file
    assert ds.scene(as_toml(scene)) == scene
    assert from_tables(as_tables(scene)) == scene
    assert ds.scene(f"{PULSE}[hand]\nhuman = {{interval_percent = 3.0, level_dB = 1.0, seed = 5}}\n") == scene


@pytest.mark.parametrize("name", shipped_names())
def test_no_shipped_scene_asks_for_it_and_a_scene_without_it_does_not_name_it(name: str) -> None:
    scene = ds.scene(name)
    assert scene.hand.human is None
    assert "human" not in as_toml(scene)
    assert from_tables(as_tables(scene)) == scene


REFUSED = {
    "no spread": (PULSE + "[hand.human]\nseed = 1\n", "missing: interval_percent, level_dB"),
    "half of it": (PULSE + "[hand.human]\nlevel_dB = 1.0\n", "missing: interval_percent"),
    "too uneven": (PULSE + HUMAN.replace("3.0", "11.0"), "interval_percent: 11.0 % is outside 0 .. 10 %"),
    "too loud and soft": (PULSE + HUMAN.replace("1.0", "2.5"), "level_dB: 2.5 dB is outside 0 .. 2 dB"),
    "another key": (PULSE + HUMAN + "jitter_ms = 3\n", "unknown key"),
    "no table": (PULSE + "[hand]\nhuman = true\n", "hand.human: must be a table, not True"),
    "no pulse": (HUMAN, "the scene needs [effects.pulse]"),
    "an arm": (PULSE + HUMAN + '[device]\nplant = "phantom"\n', 'set [device] plant = "stick"'),
    "a gesture": (PULSE + '[hand]\ngesture = "recorded"\ngesture_file = "a.csv"\n' + HUMAN, 'not gesture = "recorded"'),
    "chance": (PULSE + "[effects.noise]\nforce_N = 0.1\n" + HUMAN, "not with [effects.noise]"),
    "a flight that gains": (
        PULSE + '[effects.negative_damping]\nwhere = "above"\n' + HUMAN, "not with [effects.negative_damping]"
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_every_mistake_is_named_with_its_line(name: str) -> None:
    text, said = REFUSED[name]
    with pytest.raises(ds.SceneError) as refused:
        ds.scene(text)
    assert any(said in mistake and mistake.startswith("scene:") for mistake in refused.value.mistakes)
    assert all("hand.human" in mistake for mistake in refused.value.mistakes)
