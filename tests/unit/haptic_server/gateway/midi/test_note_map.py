"""Strike of a note: place by its number, level by its velocity, and nothing for all other messages."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haptic_server.gateway.midi.note_map import ELSEWHERE, ChokeKeys, NoteMap, places_of


def test_notes_of_general_midi_and_others() -> None:
    notes = NoteMap()
    for note, x in ((36, 0.0), (38, 0.3), (40, 0.6), (37, 0.9), (60, ELSEWHERE)):
        assert notes.strike(bytes((0x99, note, 127))) == (x, 1.0)


@pytest.mark.parametrize("curve", [0.1, 0.5, 1.0, 3.0, 10.0])
def test_the_curve_keeps_the_hardest_and_bends_what_is_below(curve: float) -> None:
    levels = [NoteMap(curve=curve).strike(bytes((0x90, 60, velocity))) for velocity in range(1, 128)]
    told = [strike.level for strike in levels if strike is not None]
    assert len(told) == 127
    assert told == sorted(set(told))
    assert told[0] > 0.0
    assert told[-1] == 1.0
    assert told[63] == pytest.approx((64 / 127) ** curve)


def test_one_channel_or_all() -> None:
    assert NoteMap(channel=10).strike(b"\x99\x26\x40") is not None
    assert NoteMap(channel=10).strike(b"\x90\x26\x40") is None


@pytest.mark.parametrize(
    "message", [b"\x99\x26\x00", b"\x89\x26\x40", b"\xb9\x10\x40", b"\xa9\x26\x40", b"\x99\x26"]
)
def test_what_begins_no_note_is_no_strike(message: bytes) -> None:
    assert NoteMap().strike(message) is None


@given(st.binary(max_size=5))
def test_every_message_is_a_strike_on_the_head_or_none(message: bytes) -> None:
    strike = NoteMap().strike(message)
    assert strike is None or (abs(strike.x) <= 1.0 and 0.0 < strike.level <= 1.0)


def test_places_are_read() -> None:
    assert places_of("36:0, 38:-0.5") == {36: 0.0, 38: -0.5}


@pytest.mark.parametrize("text", ["", "36", "36:", "128:0", "-1:0", "36:1.5", "36:nan", "a:0", "36:0,"])
def test_places_that_are_none_are_named(text: str) -> None:
    with pytest.raises(ValueError, match="note"):
        places_of(text)


def chokes(*messages: bytes, channel: int = 0) -> list[bool]:
    """For each of these messages, True if it chokes the drum."""
    keys = ChokeKeys()
    return [keys.is_choke(message, channel) for message in messages]


def test_pressure_chokes_once_when_it_comes_to_half() -> None:
    pressed = (b"\xa9\x31\x3f", b"\xa9\x31\x40", b"\xa9\x31\x7f", b"\xa9\x31\x3f", b"\xa9\x31\x7f")
    assert chokes(*pressed) == [False, True, False, False, True]
    assert chokes(b"\xd9\x20", b"\xd9\x40", b"\xd9\x7f", b"\xd8\x7f") == [False, True, False, True]


def test_each_key_has_its_own_pressure_and_a_note_begins_anew() -> None:
    assert chokes(b"\xa9\x31\x7f", b"\xa9\x32\x7f") == [True, True]
    # Pads that send 127 and never 0.
    assert chokes(b"\xa9\x31\x7f", b"\x99\x31\x40", b"\xa9\x31\x7f") == [True, False, True]


def test_another_channel_and_other_messages_choke_nothing() -> None:
    assert chokes(b"\xa9\x31\x7f", b"\xb9\x78\x00", channel=3) == [False, False]
    assert chokes(b"\xb9\x7b\x00", b"\x99\x31\x7f", b"\xa9\x31", b"\xd9\x7f\x00", b"") == [False] * 5
