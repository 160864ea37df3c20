"""The stored share of a core of each shipped scene."""

from drumstick.scenes.scene_text import shipped_names
from drumstick_lab.measuring.stored import read


def test_every_shipped_scene_has_a_share_of_a_core() -> None:
    rows = read("core_share")["rows"]
    assert set(rows) == set(shipped_names())
    assert all(row["ringing"] > 0.0 and 0.0 < row["played"] <= row["dearest"] for row in rows.values())


def test_no_shipped_scene_takes_a_quarter_of_a_core() -> None:
    """Nor in its dearest quarter of a second, where strokes are dense."""
    for name, row in read("core_share")["rows"].items():
        assert max(row["dearest"], row["ringing"]) < 0.25, name
