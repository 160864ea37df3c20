"""Set lists as a player writes them, and their scenes as they are taken up."""

from pathlib import Path

import pytest

from drumstick.scenes.scene_text import shipped_text
from haptic_server import files, set_list
from rig import set_list_file
from rig.exit_status import GIVEN, CommandError
from rig.supervision.scenes import requested_scene


def written(folder: Path, text: str) -> Path:
    (folder / "slow.toml").write_text(shipped_text("roll").replace('"roll"', '"slow"'))
    (folder / "broken.toml").write_text("name = 3\n")
    path = folder / "evening.txt"
    path.write_text(text)
    return path


def place(folder: Path) -> int:
    listed = set_list.read(folder)
    assert listed is not None
    return listed.at


def test_scenes_are_read_in_their_order_and_taken_up_by_their_number(tmp_path: Path) -> None:
    listed = set_list_file.read(written(tmp_path, "# evening\nroll\n\n  slow.toml  # mine\nroll\n"))
    assert listed.scenes == ("roll", str(tmp_path / "slow.toml"), "roll")
    (tmp_path / files.SET_LIST).write_text(listed.text())
    (tmp_path / files.WANTED).write_text("1")
    taken = requested_scene.take(tmp_path, pytest.fail)
    assert taken is not None
    assert taken.name == "slow"
    assert place(tmp_path) == 0  # it may still be refused
    taken.put(tmp_path)
    assert place(tmp_path) == 1
    (tmp_path / files.WANTED).write_text("tom")
    by_name = requested_scene.take(tmp_path, pytest.fail)
    assert by_name is not None
    by_name.put(tmp_path)
    assert place(tmp_path) == 1


def test_a_newer_wish_is_not_removed_with_the_one_that_is_taken_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted, read = tmp_path / files.WANTED, requested_scene.read_text

    def read_while_another_is_left(path: Path, max_bytes: int) -> str:
        text = read(path, max_bytes)
        wanted.write_text("snare")
        return text

    wanted.write_text("tom")
    monkeypatch.setattr(requested_scene, "read_text", read_while_another_is_left)
    first = requested_scene.take(tmp_path, pytest.fail)
    monkeypatch.undo()
    second = requested_scene.take(tmp_path, pytest.fail)
    assert first is not None
    assert second is not None
    assert (first.name, second.name) == ("tom", "snare")


def test_a_number_beyond_the_list_is_told_and_changes_nothing(tmp_path: Path) -> None:
    said: list[str] = []
    (tmp_path / files.WANTED).write_text("7")
    assert requested_scene.take(tmp_path, said.append) is None
    assert "no number 8 in the set list" in said[0]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("roll\nrol\n", r"evening.txt, line 2: no scene 'rol'; shipped: "),
        ("roll\n\nbroken.toml\n", r"evening.txt, line 3: .*broken.toml"),
        ("nowhere.toml\n", r"evening.txt, line 1: .*nowhere.toml"),
        ("# nothing yet\n", r"evening.txt: no scene in it"),
    ],
)
def test_a_mistake_is_told_with_its_file_and_line(tmp_path: Path, text: str, why: str) -> None:
    with pytest.raises(CommandError, match=why) as told:
        set_list_file.read(written(tmp_path, text))
    assert told.value.status == GIVEN
