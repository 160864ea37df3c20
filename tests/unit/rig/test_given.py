"""What the user gives and the machine lacks: one clear line and the right exit status, never a traceback."""

from pathlib import Path

import pytest

from rig import checks, folder, ports
from rig.fault import GIVEN, LACKING, Stop


@pytest.fixture
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def test_a_file_in_place_of_the_run_folder(runtime: Path) -> None:
    made = folder.run_folder("here")
    made.rmdir()
    made.touch()
    with pytest.raises(Stop, match="in the way") as stop:
        folder.run_folder("here")
    assert stop.value.status == LACKING


def test_a_symlink_in_place_of_the_run_folder(runtime: Path) -> None:
    made = folder.run_folder("here")
    made.rmdir()
    made.symlink_to(runtime / "nowhere")
    with pytest.raises(Stop, match="in the way"):
        folder.run_folder("here")
    (runtime / "nowhere").mkdir(mode=0o700)
    with pytest.raises(Stop, match="belongs to somebody else"):
        folder.run_folder("here")


def test_a_lock_or_scene_that_cannot_be_written(runtime: Path) -> None:
    made = folder.run_folder("here")
    (made / "lock").mkdir()
    with pytest.raises(Stop, match="cannot be written") as stop:
        folder.claim(made, "here")
    assert stop.value.status == LACKING
    (made / "scene.toml").mkdir()
    with pytest.raises(Stop, match="cannot be written"):
        folder.put_text(made / "scene.toml", "")
    assert sorted(p.name for p in made.iterdir()) == ["lock", "scene.toml"]


@pytest.mark.parametrize("endpoint", ["tcp/127.0.0.1:99999", "tcp/127.0.0.1:0", "tcp/:7447", "here"])
def test_an_endpoint_that_is_none(endpoint: str) -> None:
    with pytest.raises(Stop) as stop:
        checks.endpoint(endpoint)
    assert stop.value.status == GIVEN


def test_a_target_whose_name_nobody_knows() -> None:
    with pytest.raises(Stop, match="nosuch") as stop:
        checks.target("nosuch.invalid:9101")
    assert stop.value.status == GIVEN
    assert checks.target("localhost:9101") == "localhost:9101"


def test_nothing_listens_at_a_name_nobody_knows() -> None:
    assert not ports.listens("nosuch.invalid", 7447)
