"""Wishes for another scene: by name, by step through a set list, by a number."""

from pathlib import Path

import pytest

from drumstick.scenes.scene_text import shipped_names, shipped_text
from drumstick.scenes.table import Refusal
from haptic_server import files
from haptic_server.gateway.scenes.ahead import SceneAhead
from haptic_server.gateway.scenes.requests import SceneRequests
from haptic_server.set_list import SetList
from protocol.requests import ANYBODY, Claim

EVENING = ("roll", "/stage/slow.toml", "roll")


def requests(run: Path, at: int | None) -> SceneRequests:
    if at is not None:
        (run / files.SET_LIST).write_text(SetList(EVENING, at).text())
    return SceneRequests(run, True, lambda _claim: None)


@pytest.mark.parametrize(
    ("at", "asked", "left"),
    [(0, "next", "1"), (1, "next", "2"), (2, "previous", "1"), (1, "tom", "tom")],
)
def test_a_wish_is_left_as_the_number_of_the_set_list_or_as_a_name(
    tmp_path: Path, at: int, asked: str, left: str
) -> None:
    requests(tmp_path, at).ask_for(asked)
    assert (tmp_path / files.WANTED).read_text() == left


@pytest.mark.parametrize(
    ("presses", "left"),
    [
        (["next", "next"], "2"),
        (["next", "next", "previous"], "1"),
        (["next", "previous"], "0"),
        (["tom", "next"], "1"),  # by name it moves the set list nowhere
    ],
)
def test_a_step_sets_out_from_the_scene_that_was_asked_for_last(
    tmp_path: Path, presses: list[str], left: str
) -> None:
    scenes = requests(tmp_path, 0)
    for press in presses:
        scenes.ask_for(press)
    assert (tmp_path / files.WANTED).read_text() == left


def test_a_step_beyond_the_scene_that_comes_is_refused_and_the_wish_stays(tmp_path: Path) -> None:
    scenes = requests(tmp_path, 1)
    scenes.ask_for("next")
    with pytest.raises(Refusal, match="the set list ends with the one that comes"):
        scenes.ask_for("next")
    assert (tmp_path / files.WANTED).read_text() == "2"


def test_after_a_program_the_steps_go_on_from_there(tmp_path: Path) -> None:
    scenes = requests(tmp_path, 0)
    scenes.ask_for_program(1)
    scenes.ask_for("next")
    assert (tmp_path / files.WANTED).read_text() == "2"


def test_after_a_refusal_a_step_sets_out_from_the_scene_that_plays(tmp_path: Path) -> None:
    scenes = requests(tmp_path, 0)
    ahead = SceneAhead(tmp_path, shipped_text("roll"), scenes.take_refusal)
    scenes.ask_for("next")
    (tmp_path / files.WANTED).unlink()  # taken up
    (tmp_path / files.REFUSED).write_text("too hard")
    assert ahead.look() == "too hard"
    scenes.ask_for("next")
    assert (tmp_path / files.WANTED).read_text() == "1"


def test_a_refusal_of_an_older_wish_does_not_forget_a_newer_one(tmp_path: Path) -> None:
    scenes = requests(tmp_path, 0)
    scenes.ask_for("next")
    (tmp_path / files.WANTED).unlink()  # taken up
    (tmp_path / files.REFUSED).write_text("too hard")
    scenes.ask_for_program(1)
    assert scenes.take_refusal() == "too hard"
    assert scenes.take_refusal() == ""
    scenes.ask_for("next")
    assert (tmp_path / files.WANTED).read_text() == "2"


def test_a_step_asked_of_the_scene_before_at_the_last_moment_counts(tmp_path: Path) -> None:
    before = requests(tmp_path, 0)
    before.ask_for("next")
    after = requests(tmp_path, 1)
    after.follow(before)
    before.ask_for("next")  # by OSC or MIDI, which do not know the new scene yet
    with pytest.raises(Refusal, match="ends with the one that comes"):
        after.ask_for("next")


def test_a_step_asked_for_while_scenes_change_over_counts(tmp_path: Path) -> None:
    before = requests(tmp_path, 0)
    before.ask_for("next")
    before.ask_for("next")
    after = requests(tmp_path, 1)  # the first of the two plays, the second is being made ready
    after.follow(before)
    with pytest.raises(Refusal, match="ends with the one that comes"):
        after.ask_for("next")


@pytest.mark.parametrize(
    ("at", "asked", "why"),
    [
        (2, "next", "the set list ends with the one that plays"),
        (0, "previous", "the set list begins with the one that plays"),
        (None, "next", "no set list: start with `drumstick up --set-list FILE`"),
        (0, "/stage/slow.toml", "no scene"),
    ],
)
def test_what_no_step_leads_to_is_refused(tmp_path: Path, at: int | None, asked: str, why: str) -> None:
    with pytest.raises(Refusal, match=why):
        requests(tmp_path, at).ask_for(asked)
    assert not (tmp_path / files.WANTED).exists()


@pytest.mark.parametrize(("at", "left"), [(0, "1"), (None, shipped_names()[1])])
def test_a_program_is_a_scene_of_the_set_list_or_else_a_shipped_one(
    tmp_path: Path, at: int | None, left: str
) -> None:
    scenes = requests(tmp_path, at)
    scenes.ask_for_program(1)
    assert (tmp_path / files.WANTED).read_text() == left
    with pytest.raises(Refusal, match="no number 128"):
        scenes.ask_for_program(127)


def test_a_step_and_a_program_are_refused_like_a_name(tmp_path: Path) -> None:
    claims: list[Claim] = []

    def refuse(claim: Claim) -> None:
        claims.append(claim)
        raise Refusal("Ada is tuning")

    (tmp_path / files.SET_LIST).write_text(SetList(EVENING, 0).text())
    scenes = SceneRequests(tmp_path, True, refuse)
    mine = Claim(lease="mine")
    for ask in (
        lambda: scenes.ask_for("tom", mine),
        lambda: scenes.ask_for("next", mine),
        lambda: scenes.ask_for_program(1),
    ):
        with pytest.raises(Refusal, match="Ada is tuning"):
            ask()
    assert claims == [mine, mine, ANYBODY]
    assert not (tmp_path / files.WANTED).exists()
