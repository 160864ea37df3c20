"""The rigs on a network, in words."""

import json

import pytest

from protocol.keys import Keys
from rig import service_checks
from rig.exit_status import CommandError
from rig.network.discovery import NO_SERVER, Seen
from rig.network.remote_rig import RemoteRig
from rig.network.rigs import _object, _shown, _table, changes

END = RemoteRig("tcp/127.0.0.1:7447", Keys("main"))
ONE = Seen("left", "roll", "playing", 1234, 23.05, 0.7421, {"haptic": 1, "sound": 2})
ALONE = Seen("right", None, NO_SERVER, None, None, None, {"panel": 1})


def test_a_table_with_what_is_known() -> None:
    assert _table(END, [ONE, ALONE]).split("\n") == [
        "rig    scene  state             strikes  round trip  present",
        "left   roll   playing           1234     0.7 ms      haptic 1, sound 2",
        "right  -      no haptic server  -        -           panel 1",
    ]


def test_no_rig_is_said_in_words() -> None:
    assert _table(END, []).startswith(
        "no rig at tcp/127.0.0.1:7447: the router there answers and knows of none"
    )
    assert json.loads(_object(END, [])) == {"router": END.endpoint, "rigs": []}


def test_two_of_the_same_name_are_told_apart_from_one() -> None:
    doubled = ONE._replace(services={"haptic": 2})
    assert "left: several haptic servers have this name" in _table(END, [doubled])
    assert "several" not in _table(END, [ONE])


def test_json_has_null_for_what_is_not_known() -> None:
    told = json.loads(_object(END, [ONE, ALONE]))["rigs"]
    assert told[0]["services"] == {"haptic": 1, "sound": 2}
    assert (told[1]["scene"], told[1]["round_trip_ms"], told[1]["state"]) == (None, None, NO_SERVER)


def test_what_came_changed_and_went() -> None:
    before = {"left": _shown(ONE), "right": _shown(ALONE)}
    struck = ONE._replace(strikes=9999, round_trip_ms=3.0)
    assert changes(before, {**before, "left": _shown(struck)}) == []
    panic = ONE._replace(state="panic")
    new = ALONE._replace(rig="new")
    assert changes(before, {"left": _shown(panic), "new": _shown(new)}) == [
        "right: gone",
        "left: roll, panic; haptic 1, sound 2",
        "new: came: no scene, no haptic server; panel 1",
    ]


def test_what_a_stranger_makes_up_steers_no_terminal() -> None:
    made_up = ONE._replace(scene="\x1b[2Jgone", state="fault: \r\x07")
    assert _table(END, [made_up]).isprintable() is False  # the line ends only
    assert all(line.isprintable() for line in _table(END, [made_up]).split("\n"))
    assert all(line.isprintable() for line in changes({}, {"left": _shown(made_up)}))


@pytest.mark.parametrize(
    ("also", "most", "words"),
    [
        (["b", "c"], 2, "name 3 rigs, more than the 2 that one sound server plays"),
        ([f"r{n}" for n in range(8)], 8, "name 9 rigs, more than the 8"),
        ([], 9, "--most-rigs 9: must be 1 .. 8 rigs"),
        (["a/*"], 8, "--also: pattern 'a/*': use 1 to 40 letters"),
        (["a b"], 8, "--also: rig name 'a b'"),
    ],
)
def test_too_many_rigs_or_none_that_could_be(also: list[str], most: int, words: str) -> None:
    with pytest.raises(CommandError) as stop:
        service_checks.sound_rigs("main", also, most)
    assert stop.value.status == 2
    assert words in str(stop.value)


def test_patterns_take_no_seat_by_themselves() -> None:
    service_checks.sound_rigs("main", ["main", "stage-*", "*"], 1)
