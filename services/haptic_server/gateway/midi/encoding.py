"""Strikes and releases as MIDI 1.0 channel messages, three bytes each. Pure; any thread.

Velocity is 1 + round(126 level): it is linear in the speed, and never 0, which would be a note off. x and y of -1 .. 1
become the general purpose controllers 16 and 17, 64 being the middle.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

MESSAGE_BYTES = 3
NOTE_OFF, NOTE_ON, KEY_PRESSURE, CONTROL, PROGRAM, CHANNEL_PRESSURE = 0x80, 0x90, 0xA0, 0xB0, 0xC0, 0xD0
X_CONTROLLER, Y_CONTROLLER, ALL_NOTES_OFF = 16, 17, 123
ALL_SOUND_OFF = 120
RELEASE_VELOCITY = 64  # what MIDI says for who does not measure it
NOTES, CHANNELS = (0, 127), (1, 16)  # channels as musicians count
# That are heard: General MIDI has names for the first two, for the decay, and for 74: brightness.
VOLUME_CONTROLLER, PAN_CONTROLLER, RATE_CONTROLLER, LEVEL_CONTROLLER = 7, 10, 18, 19
MUFFLE_CONTROLLER, STRAINER_CONTROLLER, PITCH_CONTROLLER, DECAY_CONTROLLER = 20, 21, 22, 75
MASS_CONTROLLER, STIFFNESS_CONTROLLER = 23, 74
GLIDE_CONTROLLER, YOUNG_CONTROLLER = 28, 29
PLACE_CONTROLLERS = (24, 25, 26, 27)  # x and y of the first two pickups
DEFAULT_NOTE, DEFAULT_CHANNEL = 38, 10  # acoustic snare, on the channel of percussion (General MIDI)


def is_channel_message(message: Sequence[int]) -> bool:
    """True for three bytes, and for the two of a program or of a channel's pressure."""
    return len(message) == MESSAGE_BYTES or (
        len(message) == 2 and message[0] & 0xF0 in (PROGRAM, CHANNEL_PRESSURE)
    )


def velocity(level: float) -> int:
    """1 .. 127 of a level, which is clipped to 0 .. 1; ValueError when it is not finite."""
    if not math.isfinite(level):
        raise ValueError(f"level {level} is no finite number")
    return 1 + round(126.0 * min(max(level, 0.0), 1.0))


def controller_value(place: float) -> int:
    """0 .. 127 of a place, which is clipped to -1 .. 1; ValueError when it is not finite."""
    if not math.isfinite(place):
        raise ValueError(f"place {place} is no finite number")
    return round(127.0 * (min(max(place, -1.0), 1.0) + 1.0) / 2.0)


@dataclass(frozen=True)
class Voice:
    """Note and channel of a strike, within NOTES and CHANNELS; else ValueError."""

    note: int = DEFAULT_NOTE
    channel: int = DEFAULT_CHANNEL

    def __post_init__(self) -> None:
        for name, number, (low, high) in (("note", self.note, NOTES), ("channel", self.channel, CHANNELS)):
            if not low <= number <= high:
                raise ValueError(f"MIDI {name} {number}: must be {low} .. {high}")

    def _message(self, kind: int, first: int, second: int) -> bytes:
        return bytes((kind | (self.channel - 1), first, second))

    def on(self, level: float) -> bytes:
        """The note begins."""
        return self._message(NOTE_ON, self.note, velocity(level))

    def off(self) -> bytes:
        """The note ends."""
        return self._message(NOTE_OFF, self.note, RELEASE_VELOCITY)

    def control(self, controller: int, place: float) -> bytes:
        """A controller takes a value."""
        return self._message(CONTROL, controller, controller_value(place))

    def silence(self) -> bytes:
        """The note ends, and whatever else sounds on the channel."""
        return self.off() + self._message(CONTROL, ALL_NOTES_OFF, 0)
