"""Scenes with a recorded gesture, as a user gives them: found beside the scene, checked, put into the run folder."""

from pathlib import Path

import pytest

from drumstick.scenes.scene_text import shipped_gesture, shipped_text
from haptic_server import files
from rig import scene_file
from rig.exit_status import GIVEN, CommandError
from rig.offline import scene_commands
from rig.supervision import up
from rig.supervision.parts import HAPTIC
from rig.supervision.plan import Options


def scene_in(folder: Path, gesture: str | bytes | None) -> str:
    scene = folder / "mine.toml"
    scene.write_text(shipped_text("accents").replace("accents.csv", "path.csv"), encoding="utf-8")
    if gesture is not None:
        given = gesture if isinstance(gesture, bytes) else gesture.encode()
        (folder / "path.csv").write_bytes(given)
    return str(scene)


def test_the_shipped_one_is_read_from_the_package() -> None:
    found = scene_file.gesture("accents", scene_file.load("accents"))
    assert found == shipped_gesture("accents.csv")
    assert scene_file.gesture("roll", scene_file.load("roll")) is None


@pytest.mark.parametrize(
    ("gesture", "said"),
    [
        (None, "path.csv: cannot be read: No such file or directory; it must lie beside the scene"),
        ("t_s,z_m\n0,0.02\n1,0.5\n", "hand.gesture_file: path.csv:3: z_m: 0.5 m is outside -0.1 .. 0.3 m"),
        ("t_s,z_m\n0,0.02\n\n0.1,0.2\n", "path.csv:4: z_m: comes here at 1.8 m/s, faster than 1 m/s"),
        (b"t_s,z_m\n0,\xff\n", "path.csv: not UTF-8 text; give CSV"),
    ],
)
def test_a_gesture_that_is_wrong_is_told_by_check_with_status_2(
    tmp_path: Path, gesture: str | bytes | None, said: str
) -> None:
    with pytest.raises(CommandError) as stop:
        scene_commands.check(scene_in(tmp_path, gesture))
    assert said in str(stop.value)
    assert "mine.toml" in str(stop.value)
    assert stop.value.status == GIVEN


def test_up_puts_scene_and_gesture_into_the_run_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "scenes").mkdir()
    (tmp_path / "run").mkdir()
    gesture = "t_s,z_m\n0,0.02\n1,-0.01\n2,0.02\n"
    given = scene_in(tmp_path / "scenes", gesture)
    seen: dict[str, str] = {}

    class Begun(Exception):
        pass

    def begin(options: Options, *_: object) -> None:
        seen.update({f.name: f.read_text() for f in options.folder.iterdir()})
        raise Begun

    monkeypatch.setattr(up, "Rig", begin)
    options = Options(
        rig="gesture",
        folder=tmp_path / "run",
        state=tmp_path / "state",
        connect="tcp/127.0.0.1:1",
        parts=frozenset({HAPTIC}),
        osc_bind=("127.0.0.1", 0),
    )
    with pytest.raises(Begun):
        up.up(options, given, None, as_json=False)
    assert seen[files.GESTURE] == gesture
    assert seen[files.SCENE] == Path(given).read_text(encoding="utf-8")
