"""Frames of the stage: where the stick was, by its states and its contacts, and words where nothing plays."""

from typing import Any

import msgspec
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Readback, Release, State, Strike
from rig_messages import state as some_state
from rig_messages import strike as some_strike
from web_panel.rig.rig_state import RigState
from web_panel.stage.stage_frame import stage_frame

ROLL = parse(shipped_text("roll"), "roll")
R = ROLL.drum.radius_m


def state(t_ms: float, status: str = "playing", **more: Any) -> State:
    at: dict[str, Any] = {"z_m": 0.01, "v_m_per_s": 0.1, "x": 0.3, "y": 0.2, **more}
    return some_state(t_ns=int(t_ms * 1e6), status=status, **at)


def strike(t_ms: float, **more: Any) -> Strike:
    at: dict[str, Any] = {"x": 0.3, "y": 0.2, "z_speed_m_per_s": 0.56, "level": 0.3, **more}
    return some_strike(t_ns=int(t_ms * 1e6), **at)


def heard(*states: State) -> RigState:
    rig_state = RigState(connected=True)
    rig_state.note_scene(ROLL, table_of(ROLL))
    for each in states:
        rig_state.note_state(each, 0.0)
    return rig_state


def test_contacts_stand_between_the_states_with_their_speeds() -> None:
    rig_state = heard(state(1000.0), state(1033.0))
    rig_state.note_strike(strike(1010.0), 0.0)
    release = Release(
        boot=1,
        seq=1,
        t_ns=1_015_000_000,
        exit_speed_m_per_s=0.63,
        impulse_N_s=0.015,
        peak_N=5.0,
        contact_s=0.005,
    )
    rig_state.note_release(release, 0.0)
    frame = stage_frame(rig_state, "main", 0.0)
    assert [place.at_ms for place in frame.places] == [1000.0, 1010.0, 1015.0, 1033.0]
    assert [place.tip[2] for place in frame.places] == pytest.approx([0.01 / R, 0.0, 0.0, 0.01 / R])
    assert [place.v for place in frame.places] == pytest.approx([0.1 / R, -0.56 / R, 0.63 / R, 0.1 / R])
    assert [(f.at_ms, f.x, f.y, f.level) for f in frame.flashes] == [(1010.0, 0.3, 0.2, 0.3)]
    assert frame.words == ""
    assert msgspec.json.decode(msgspec.json.encode(frame))["places"][1][0] == 1010.0


def test_a_strike_that_no_stick_made_flashes_and_moves_no_stick() -> None:
    rig_state = heard(state(1000.0))
    rig_state.note_strike(strike(1010.0, source="page", level=7.0), 0.0)
    frame = stage_frame(rig_state, "main", 0.0)
    assert [place.at_ms for place in frame.places] == [1000.0]
    assert [(flash.at_ms, flash.level) for flash in frame.flashes] == [(1010.0, 1.0)]


def test_it_moves_with_the_device_and_the_hand() -> None:
    rig_state = heard(state(1000.0), state(1033.0, x=-0.5, y=0.4))
    before = stage_frame(rig_state, "main", 0.0).places
    assert before[1].tip[:2] == (-0.5, 0.4)
    across = [before[1].grip[i] - before[0].grip[i] for i in (0, 1)]
    assert across == pytest.approx([-0.8, 0.2])
    rig_state.note_readback("z_h0", Readback(value=-0.02, revision=1))
    assert stage_frame(rig_state, "main", 0.0).places[0].grip[2] == pytest.approx(
        before[0].grip[2] - 0.02 / R
    )


@pytest.mark.parametrize(
    ("status", "words", "mood"),
    [
        ("ready", "Ready", "good"),
        ("panic", "Panic: zero force", "bad"),
        ("fault: unplugged", "Fault: unplugged", "bad"),
        ("playing", "", "busy"),
    ],
)
def test_the_pages_words_where_nothing_plays(status: str, words: str, mood: str) -> None:
    frame = stage_frame(heard(state(1000.0, status)), "main", 0.0)
    assert (frame.words, frame.mood) == (words, mood)


def test_a_rig_that_is_silent_or_was_never_heard() -> None:
    silent = stage_frame(heard(state(1000.0)), "main", 7.0)
    assert (silent.words, silent.mood) == ("No data from the haptic server for 7 s", "bad")
    never = stage_frame(RigState(), "main", 0.0)
    assert (never.words, never.places) == ("Waiting for the haptic server", ())


def test_what_was_sent_is_not_sent_again() -> None:
    rig_state = heard(state(1000.0))
    rig_state.note_strike(strike(1010.0), 0.0)
    rig_state.forget_news()
    frame = stage_frame(rig_state, "main", 0.0)
    assert (frame.places, frame.flashes) == ((), ())
