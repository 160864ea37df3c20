"""A scene with an old name: every command that reads it says so once, and what is written has the new name."""

import json
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick_lab.soak.quicker import quicker
from haptic_server import files
from rig import scene_file
from rig.exit_status import GIVEN, CommandError
from rig.offline import scene_commands
from rig.offline.render import RenderOptions, render
from rig.supervision import up
from rig.supervision.parts import HAPTIC
from rig.supervision.plan import Options
from rig.supervision.scenes import requested_scene
from rig.supervision.scenes.scene_change import install_scene

OLD = "[drum.effects.air_loss]\nt60_s = 0.5\n"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(f"[mesh]\naccuracy = 'draft'\n{OLD}", encoding="utf-8")
    return path


def note(scene: Path) -> str:
    return (
        f"{scene}:3: drum.effects.air_loss: is called uniform_loss now; "
        "the old name is still read for a while: rename it there"
    )


def test_check_notes_it_on_stderr_and_calls_the_scene_good(
    scene: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene_commands.check(str(scene))
    out, err = capsys.readouterr()
    assert out == "mine: good; effects: none\n"
    assert err == f"drumstick: {note(scene)}\n"


def test_render_notes_it(scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    render(str(scene), RenderOptions(tmp_path / "x.wav", 0.1, None, False, 48_000), as_json=True)
    out, err = capsys.readouterr()
    assert json.loads(out)["scene"] == "mine"
    assert err.count(note(scene)) == 1


def test_show_writes_the_new_name(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene_commands.show(str(scene), as_json=False)
    out, err = capsys.readouterr()
    assert out == scene.read_text(encoding="utf-8").replace("air_loss", "uniform_loss")
    assert note(scene) in err
    scene_commands.show(str(scene), as_json=True)
    assert list(json.loads(capsys.readouterr().out)["drum"]["effects"]) == ["uniform_loss"]


def test_a_shipped_scene_is_shown_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    scene_commands.show("snare", as_json=False)
    assert capsys.readouterr() == (shipped_text("snare").rstrip() + "\n", "")


def test_a_quicker_scene_has_the_new_name() -> None:
    text = shipped_text("roll") + OLD
    made = quicker(text, "roll", 2.0)
    assert "air_loss" not in made
    assert parse(made, "roll").drum == parse(text, "roll").drum


def test_both_names_are_an_error_of_who_gave_them(scene: Path) -> None:
    scene.write_text(OLD + OLD.replace("air_loss", "uniform_loss"), encoding="utf-8")
    with pytest.raises(CommandError, match=r"mine\.toml:1: .* delete \[drum\.effects\.air_loss\]") as stop:
        scene_commands.check(str(scene))
    assert stop.value.status == GIVEN


def test_up_notes_it_once(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Begun(Exception):
        pass

    def begin(*_: object) -> None:
        raise Begun

    monkeypatch.setattr(up, "Rig", begin)
    options = Options(
        rig="old-name",
        folder=tmp_path / "run",
        state=tmp_path / "state",
        connect="tcp/127.0.0.1:1",
        parts=frozenset({HAPTIC}),
    )
    options.folder.mkdir()
    with pytest.raises(Begun):
        up.up(options, str(scene), None, as_json=False)
    assert capsys.readouterr().err.count(note(scene)) == 1
    assert (options.folder / files.SCENE).exists()


def test_a_rig_notes_it_where_it_says_all_else(
    scene: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said: list[str] = []
    (tmp_path / files.WANTED).write_text(str(scene), encoding="utf-8")
    assert requested_scene.take(tmp_path, said.append) == scene_file.scene_files(str(scene), said.append)
    assert said == [note(scene)] * 2
    install_scene(tmp_path, str(scene), said.append)
    assert said == [note(scene)] * 3
    assert capsys.readouterr().err == ""
