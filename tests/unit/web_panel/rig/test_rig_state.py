import msgspec

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import table_of
from protocol.messages import Meter, Readback
from rig_messages import state, strike
from web_panel.rig.rig_state import RigState

METER = Meter(
    id="a", t_ns=0, sink="null", peak_left=0.0, peak_right=0.0, load=0.0, xruns=0, latency_ms=0.0, played=0, late=0,
    duplicates=0,
)  # fmt: skip


def test_the_output_was_limited_lately_when_its_count_has_grown() -> None:
    rig_state = RigState()
    for at, frames in ((0.0, 50), (1.0, 50)):  # those of before this panel came
        rig_state.note_meter(msgspec.structs.replace(METER, limited_frames=frames), at)
    assert not rig_state.was_limited(1.0)
    rig_state.note_meter(msgspec.structs.replace(METER, limited_frames=51), 2.0)
    rig_state.note_meter(msgspec.structs.replace(METER, limited_frames=51), 3.0)
    assert rig_state.was_limited(5.9)
    for at in (5.9, 7.5):
        rig_state.note_meter(msgspec.structs.replace(METER, limited_frames=51), at)
    assert not rig_state.was_limited(7.5)
    rig_state.note_meter(msgspec.structs.replace(METER, limited_frames=52), 8.0)
    assert rig_state.was_limited(8.0)
    assert not rig_state.was_limited(12.0), "its server is not heard any more"


def test_silence_is_counted_from_the_last_state() -> None:
    rig_state = RigState()
    assert rig_state.silent_s(10.0) is None
    rig_state.note_state(state(boot=1), 10.0)
    assert rig_state.silent_s(10.9) == 0.0
    assert rig_state.silent_s(14.0) == 4.0


def test_a_strike_of_an_earlier_start_is_forgotten() -> None:
    rig_state = RigState()
    rig_state.note_state(state(boot=1), 0.0)
    rig_state.strike = strike()
    rig_state.note_state(state(boot=1), 0.1)
    assert rig_state.strike is not None
    rig_state.note_state(state(boot=2), 0.2)
    assert rig_state.strike is None


def test_an_older_readback_never_replaces_a_newer_one() -> None:
    rig_state = RigState()
    rig_state.note_readback("dv_pls", Readback(value=0.3, revision=5, pending=True))
    rig_state.note_readback("dv_pls", Readback(value=0.2, revision=4))
    assert rig_state.readbacks["dv_pls"].value == 0.3
    rig_state.note_readback("dv_pls", Readback(value=0.3, revision=5))
    assert not rig_state.readbacks["dv_pls"].pending
    rig_state.note_readback("dv_pls", Readback(value=0.2, revision=5, pending=True))
    assert rig_state.readbacks["dv_pls"] == Readback(value=0.3, revision=5)


def test_what_waits_is_the_setpoint_and_not_the_readback() -> None:
    rig_state = RigState()
    rig_state.note_readback("dv_pls", Readback(value=0.2, revision=4))
    rig_state.note_accepted("dv_pls", Readback(value=0.3, revision=5, pending=True))
    assert rig_state.readbacks["dv_pls"].value == 0.2
    assert rig_state.standing() == {"dv_pls": 0.3}
    rig_state.note_readback("dv_pls", Readback(value=0.2, revision=4, pending=True))
    assert rig_state.setpoints["dv_pls"].value == 0.3
    rig_state.note_readback("dv_pls", Readback(value=0.3, revision=5))
    assert rig_state.setpoints == {}
    assert rig_state.standing() == {"dv_pls": 0.3}
    # The publication was quicker than the answer.
    rig_state.note_accepted("dv_pls", Readback(value=0.3, revision=5, pending=True))
    assert rig_state.setpoints == {}
    rig_state.note_accepted("dv_pls", Readback(value=0.4, revision=6))
    assert rig_state.readbacks["dv_pls"].value == 0.4


def test_the_same_scene_again_keeps_the_values() -> None:
    rig_state = RigState()
    roll, paper = (parse(shipped_text(name), name) for name in ("roll", "paper-roll"))
    rig_state.note_scene(roll, table_of(roll))
    rig_state.note_readback("dv_pls", Readback(value=0.3, revision=5))
    rig_state.note_scene(parse(shipped_text("roll"), "roll"), table_of(roll))
    assert (rig_state.scenes_seen, len(rig_state.readbacks)) == (1, 1)
    rig_state.note_scene(paper, table_of(paper))
    assert (rig_state.scenes_seen, len(rig_state.readbacks)) == (2, 0)


def test_a_sound_server_that_went_away_is_not_shown() -> None:
    rig_state = RigState()
    rig_state.note_meter(METER, 0.0)
    rig_state.note_meter(msgspec.structs.replace(METER, id="b"), 2.0)
    assert [m.id for m in rig_state.living_meters(2.5)] == ["a", "b"]
    assert [m.id for m in rig_state.living_meters(4.0)] == ["b"]
    rig_state.note_meter(msgspec.structs.replace(METER, id="b"), 10.0)
    assert list(rig_state.meters) == ["b"]


def test_names_that_somebody_makes_up_do_not_fill_the_memory() -> None:
    rig_state = RigState()
    rig_state.note_readback("dv_pls", Readback(value=0.3, revision=1))
    for number in range(5000):
        rig_state.note_readback(f"made up {number}", Readback(value=0.3, revision=1))
        rig_state.note_meter(msgspec.structs.replace(METER, id=str(number)), 0.0)
    assert len(rig_state.readbacks) == len(rig_state.meters) == 1000
    rig_state.note_readback("dv_pls", Readback(value=0.4, revision=2))
    assert rig_state.readbacks["dv_pls"].value == 0.4
    rig_state.note_meter(METER, 10.0)  # those that fell silent make room
    assert [meter.id for meter in rig_state.living_meters(10.0)] == [METER.id]
