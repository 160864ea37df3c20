"""Files of a run folder that a crash, or another program of this user, left broken: bounded reads, and nothing ends."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from drumstick.safety.envelope import Limits
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from haptic_server import block, block_header, files, limits
from rig.supervision.scenes import requested_scene, scene_change

Break = Callable[[Path], object]
HARMS: dict[str, Break] = {
    "folder": Path.mkdir,
    "pipe": os.mkfifo,
    "not UTF-8": lambda path: path.write_bytes(b"\xff\xfe"),
    "cut off": lambda path: path.write_text("{"),
    "huge": lambda path: path.write_bytes(b" " * 300_000),
    "deep": lambda path: path.write_text("[" * 50_000),
    "another's": lambda path: path.write_text('{"max_force_N": "much", "no": 1}'),
    "a list": lambda path: path.write_text("[]"),
}
broken = pytest.mark.parametrize("harm", HARMS.values(), ids=HARMS.keys())


@broken
def test_a_wish_that_cannot_be_read_is_said_once_and_gone(tmp_path: Path, harm: Break) -> None:
    harm(tmp_path / files.WANTED)
    said: list[str] = []
    assert requested_scene.take(tmp_path, said.append) is None
    assert len(said) == 1
    assert requested_scene.take(tmp_path, said.append) is None
    assert len(said) == 1


def test_a_wish_is_taken_up_once(tmp_path: Path) -> None:
    (tmp_path / files.WANTED).write_text("tom")
    said: list[str] = []
    found = requested_scene.take(tmp_path, said.append)
    assert found is not None
    assert found.name == "tom"
    assert requested_scene.take(tmp_path, said.append) is None
    assert said == []


@broken
def test_limits_that_cannot_be_read_are_those_of_the_scene(tmp_path: Path, harm: Break) -> None:
    scene = parse(shipped_text("roll"), "roll")
    harm(tmp_path / files.LIMITS)
    assert limits.read(tmp_path, scene) == Limits.of(scene)


def test_limits_come_as_they_were_written(tmp_path: Path) -> None:
    written = Limits(12.0, 3.0)
    limits.write(tmp_path, written)
    assert limits.read(tmp_path, parse(shipped_text("roll"), "roll")) == written
    assert [each.name for each in tmp_path.iterdir()] == [files.LIMITS]


@pytest.mark.parametrize("harm", ["folder", "pipe", "not UTF-8", "cut off", "huge", "deep", "a list"])
def test_doctor_is_told_that_a_file_cannot_be_read(tmp_path: Path, harm: str) -> None:
    HARMS[harm](tmp_path / files.GRANTED)
    found = limits.read_object(tmp_path / files.GRANTED)
    assert list(found) == ["unreadable"]


@broken
def test_what_is_no_block_is_said_to_be_none(tmp_path: Path, harm: Break) -> None:
    harm(tmp_path / files.BLOCK)
    with pytest.raises(block_header.BlockError):
        block.attach(tmp_path, law_of(parse(shipped_text("roll"), "roll")).dtype)


@pytest.mark.parametrize("harm", [name for name in HARMS if name != "folder"])
def test_a_scene_that_lies_broken_gives_way_to_the_configured_one(tmp_path: Path, harm: str) -> None:
    HARMS[harm](tmp_path / files.SCENE)
    scene_change.install_scene(tmp_path, "roll", lambda _words: None)
    assert (tmp_path / files.SCENE).read_text(encoding="utf-8") == shipped_text("roll")
