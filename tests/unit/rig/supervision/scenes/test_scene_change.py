"""Scene that the next servo plays where systemd starts it: asked for, configured, held, or the one before."""

import os
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block, block_header, files
from haptic_server.block_header import HELD
from realtime.atomics import poke
from rig.exit_status import GIVEN, LACKING, CommandError
from rig.supervision import service
from rig.supervision.scenes.scene_change import BEFORE, ended, install_scene, played


class Run:
    """A run folder, and what was said."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.said: list[str] = []

    def install_scene(self, configured: str = "roll", wanted: str = "") -> str:
        """Name of the scene that lies there then."""
        if wanted:
            (self.folder / files.WANTED).write_text(wanted)
        install_scene(self.folder, configured, self.said.append, "left")
        return self.lying

    @property
    def lying(self) -> str:
        return parse((self.folder / files.SCENE).read_text(), "lying").name

    def servo_left(self, held: bool | None) -> None:
        """Files that a servo of the scene there leaves when it ends; None: ended before its first tick."""
        law = law_of(parse((self.folder / files.SCENE).read_text(), "lying"))
        made = block.create(self.folder, law, 1)
        if held is not None:
            poke(made.control, HELD, int(held))


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return Run(tmp_path)


def test_the_first_start_plays_what_the_options_name(run: Run) -> None:
    assert run.install_scene("tom") == "tom"


def test_a_crash_leaves_scene_and_block_alone(run: Run) -> None:
    run.install_scene()
    run.servo_left(held=False)
    before = (run.folder / files.BLOCK).stat().st_ino
    assert run.install_scene() == "roll"
    assert (run.folder / files.BLOCK).stat().st_ino == before


def test_what_was_asked_for_is_played_once_and_stays(run: Run) -> None:
    run.install_scene()
    run.servo_left(held=False)
    assert run.install_scene(wanted="snare") == "snare"
    assert not (run.folder / files.WANTED).exists()
    assert (
        block.inherited_state(run.folder, law_of(parse(shipped_text("snare"), "snare")).dtype) is None
    )  # of another scene
    assert run.install_scene() == "snare"


def test_changed_options_win_over_what_was_asked_for(run: Run) -> None:
    run.install_scene()
    run.install_scene(wanted="snare")
    assert run.install_scene("tom") == "tom"


@pytest.mark.parametrize(("configured", "wanted"), [("roll", "snare"), ("tom", "")])
def test_a_held_scene_stays_whatever_is_asked_for(run: Run, configured: str, wanted: str) -> None:
    run.install_scene()
    run.servo_left(held=True)
    assert run.install_scene(configured, wanted) == "roll"
    assert (run.folder / files.BLOCK).exists()
    assert "sudo drumstick-at left arm first" in run.said[-1]
    assert not (run.folder / files.WANTED).exists()


def test_a_panic_while_the_scene_is_laid_out_holds_the_new_one(run: Run) -> None:
    run.install_scene()
    run.servo_left(held=False)
    gateway = block.attach(run.folder, law_of(parse(shipped_text("roll"), "roll")).dtype)
    assert run.install_scene(wanted="snare") == "snare"
    block_header.raise_panic(
        run.folder, gateway.header_view
    )  # a gateway that still lives, on the block that it has mapped
    run.servo_left(held=None)
    assert block_header.was_held(run.folder)
    assert run.install_scene(wanted="tom") == "snare"


@pytest.mark.parametrize("status", [GIVEN, LACKING])
def test_a_scene_that_cannot_be_played_gives_way_to_the_one_before(run: Run, status: int) -> None:
    run.install_scene()
    run.install_scene(wanted="snare")
    ended(run.folder, status, run.said.append)
    assert run.lying == "roll"
    assert "back to the previous scene" in run.said[-1]
    assert run.install_scene() == "roll"


@pytest.mark.parametrize(("has_played", "status"), [(True, LACKING), (False, 1), (False, 0)])
def test_what_has_played_or_crashed_is_not_given_up(run: Run, has_played: bool, status: int) -> None:
    run.install_scene()
    run.install_scene(wanted="snare")
    if has_played:
        played(run.folder)
    ended(run.folder, status, run.said.append)
    assert run.lying == "snare"


def test_a_scene_that_this_version_does_not_know_is_replaced(run: Run) -> None:
    run.install_scene()
    (run.folder / files.SCENE).write_text("from = 'another version'")
    assert run.install_scene() == "roll"


def test_a_damaged_way_back_ends_at_the_configured_scene(run: Run) -> None:
    run.install_scene()
    run.install_scene(wanted="snare")
    (run.folder / BEFORE).write_text('{"name":')
    with pytest.raises(CommandError, match=BEFORE):
        ended(run.folder, GIVEN, run.said.append)
    assert run.install_scene() == "roll"


def test_a_wrong_name_is_refused_and_the_scene_stays(run: Run) -> None:
    run.install_scene()
    assert run.install_scene(wanted="none") == "roll"  # and the servo starts: a wish is no reason to end
    assert "no scene 'none'" in run.said[-1]
    assert run.install_scene() == "roll"


@pytest.mark.parametrize(("how", "status"), [("killed", "9"), ("exited", "TERM"), ("exited", "0")])
def test_only_an_exit_status_speaks_of_the_scene(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, how: str, status: str
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    folder = tmp_path / f"drumstick-{os.getuid()}-main"
    folder.mkdir(mode=0o700)
    (folder / files.SCENE).write_text(shipped_text("tom"))
    (folder / BEFORE).write_text("{}")
    service.servo_ended("main", how, status)
    assert (folder / BEFORE).exists()


def test_what_a_killed_command_left_of_its_next_scene_and_set_list_goes(run: Run) -> None:
    (run.folder / files.NEXT).mkdir()
    (run.folder / files.NEXT / files.SCENE).write_text(shipped_text("tom"))
    for name in (files.SET_LIST, files.REFUSED):
        (run.folder / name).write_text("left")
    assert run.install_scene() == "roll"
    left = {path.name for path in run.folder.iterdir()}
    assert not left & {files.NEXT, files.SET_LIST, files.REFUSED}
