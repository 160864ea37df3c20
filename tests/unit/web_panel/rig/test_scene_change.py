from typing import cast

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import State
from rig_messages import state
from web_panel.rig.rig_state import RigState
from web_panel.rig.scene_change import SceneChange


def start(rig_state: RigState, boot: int, scene: str, next_scene: str = "", scene_refusal: str = "") -> None:
    """The servo starts and tells its scene."""
    rig_state.note_state(state(boot=boot, next_scene=next_scene, scene_refusal=scene_refusal), 0.0)
    told = parse(shipped_text(scene), scene)
    rig_state.note_scene(told, table_of(told))


@pytest.mark.parametrize(
    ("asked", "played", "words", "alarm"),
    [
        ("tom", "tom", "tom is playing", False),
        ("tom", "roll", "tom could not be played; back to roll", True),
        ("roll", "roll", "roll is playing", False),
    ],
)
def test_what_became_of_it_is_told_once_by_the_next_start(
    asked: str, played: str, words: str, alarm: bool
) -> None:
    rig_state, change = RigState(), SceneChange()
    start(rig_state, 1, "roll")
    assert change.outcome(rig_state, 9.0) is None
    change.begin(asked, rig_state, 10.0)
    start(rig_state, 1, "roll")  # the old servo is still there
    assert change.outcome(rig_state, 13.0) == (f"{asked} is starting: 3 s", False)
    assert change.asked == asked
    start(rig_state, 2, played)
    assert change.outcome(rig_state, 14.0) == (words, alarm)
    assert change.outcome(rig_state, 14.1) is None
    assert change.asked == ""


def test_a_refusal_ends_it_and_is_told_once() -> None:
    rig_state, change = RigState(), SceneChange()
    start(rig_state, 1, "roll", scene_refusal="of before")
    change.begin("tom", rig_state, 10.0)
    assert change.outcome(rig_state, 11.0) == ("tom is starting: 1 s", False)
    start(rig_state, 1, "roll", scene_refusal="tom cannot be played here: roll plays on")
    assert change.outcome(rig_state, 12.0) == ("tom cannot be played here: roll plays on", True)
    assert change.outcome(rig_state, 12.1) is None


def test_a_change_that_somebody_else_asked_for_is_told_too() -> None:
    """As long as the rig makes it ready, it is no alarm; what was heard long ago says nothing."""
    rig_state, change = RigState(), SceneChange()
    start(rig_state, 1, "roll", next_scene="tom")
    assert change.outcome(rig_state, 0.0) == ("tom is starting: 0 s", False)
    rig_state.note_state(cast(State, rig_state.state), 99.0)
    assert change.outcome(rig_state, 99.0) == ("tom is starting: 99 s", False)
    assert change.outcome(rig_state, 120.0) == ("tom has not started within 60 s", True)
    assert change.outcome(rig_state, 121.0) is None


def test_a_scene_that_never_starts_is_an_alarm_after_a_minute() -> None:
    rig_state, change = RigState(), SceneChange()
    start(rig_state, 1, "roll")
    change.begin("tom", rig_state, 10.0)
    assert change.outcome(rig_state, 69.9) == ("tom is starting: 60 s", False)
    assert change.outcome(rig_state, 70.0) == ("tom has not started within 60 s", True)
    assert change.asked == ""


def test_a_newer_wish_takes_the_place_of_the_one_that_is_shown() -> None:
    """*Next* twice: the scene in between never plays, and that is no failure."""
    rig_state, change = RigState(), SceneChange()
    start(rig_state, 1, "roll", next_scene="tom")
    assert change.outcome(rig_state, 0.0) == ("tom is starting: 0 s", False)
    start(rig_state, 1, "roll", next_scene="snare")
    assert change.outcome(rig_state, 0.5) == ("snare is starting: 0 s", False)
    start(rig_state, 2, "snare")
    assert change.outcome(rig_state, 0.8) == ("snare is playing", False)


def test_what_is_still_made_ready_for_somebody_else_hides_no_wish_of_this_page() -> None:
    rig_state, change = RigState(), SceneChange()
    start(rig_state, 1, "roll", next_scene="tom")
    change.outcome(rig_state, 0.0)
    change.begin("snare", rig_state, 0.1)
    assert change.outcome(rig_state, 0.2) == ("snare is starting: 0 s", False)
