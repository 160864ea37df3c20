"""Every note, channel, level and place as MIDI bytes."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from haptic_server.gateway.midi.encoding import Voice, controller_value, is_channel_message, velocity


def test_messages_of_notes_pressure_and_programs_are_heard_and_clocks_are_not() -> None:
    heard = [(0x99, 36, 127), (0xA9, 49, 127), (0xD9, 64), (0xC9, 1)]
    assert all(is_channel_message(message) for message in heard)
    assert not any(is_channel_message(message) for message in ((0xF8,), (0xF1, 2), (0xF0, 1, 2, 0xF7)))


@pytest.mark.parametrize(
    ("level", "expected"), [(0.0, 1), (1.0, 127), (0.5, 64), (1 / 126, 2), (-0.5, 1), (7.0, 127), (5e-324, 1)]
)
def test_velocity_by_hand(level: float, expected: int) -> None:
    assert velocity(level) == expected


@pytest.mark.parametrize(
    ("place", "expected"), [(-1.0, 0), (0.0, 64), (1.0, 127), (-2.0, 0), (1e308, 127), (-0.5, 32), (0.5, 95)]
)
def test_controllers_by_hand(place: float, expected: int) -> None:
    assert controller_value(place) == expected


def test_every_velocity_and_controller_value_can_be_had() -> None:
    assert {velocity(i / 126) for i in range(127)} == set(range(1, 128))
    assert {controller_value(2 * i / 127 - 1) for i in range(128)} == set(range(128))


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_louder_is_never_softer(a: float, b: float) -> None:
    low, high = sorted((a, b))
    assert velocity(low) <= velocity(high)
    assert abs(velocity(a) - (1 + 126 * a)) <= 0.5 + 1e-9
    assert controller_value(low) <= controller_value(high)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(value: float) -> None:
    for encode in (velocity, controller_value):
        with pytest.raises(ValueError, match="no finite number"):
            encode(value)


def test_every_note_on_every_channel() -> None:
    for channel in range(1, 17):
        for note in range(128):
            voice = Voice(note, channel)
            for level in (0.0, 0.5, 1.0):
                assert voice.on(level) == bytes((0x8F + channel, note, velocity(level)))
            assert voice.off() == bytes((0x7F + channel, note, 64))
            assert voice.silence() == voice.off() + bytes((0xAF + channel, 123, 0))
        assert Voice(38, channel).control(16, 0.0) == bytes((0xAF + channel, 16, 64))


@pytest.mark.parametrize(("note", "channel"), [(-1, 1), (128, 1), (0, 0), (0, 17)])
def test_what_midi_does_not_have(note: int, channel: int) -> None:
    with pytest.raises(ValueError, match="must be"):
        Voice(note, channel)


@given(st.floats(allow_nan=False), st.floats(-1, 1), st.integers(0, 127), st.integers(1, 16))
def test_every_message_is_well_formed(level: float, place: float, note: int, channel: int) -> None:
    voice = Voice(note, channel)
    for message in (
        voice.off(),
        voice.control(17, place),
        *([voice.on(level)] if math.isfinite(level) else []),
    ):
        assert len(message) == 3
        assert message[0] >= 0x80
        assert max(message[1:]) <= 0x7F
        assert message[0] & 0x0F == channel - 1
