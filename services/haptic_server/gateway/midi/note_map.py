"""MIDI that comes in: where each note falls on the head, how hard a velocity is, what a controller asks for.

Pure; any thread.

x of a note is by its number in General MIDI: bass drum in the middle, snares further out, side stick at the rim. The
level is (velocity / 127) to the power of the curve: below 1 a soft keyboard plays louder, above 1 a hard one softer.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

from haptic_server.gateway.midi import encoding
from haptic_server.gateway.midi.encoding import (
    CHANNEL_PRESSURE,
    CONTROL,
    KEY_PRESSURE,
    NOTE_OFF,
    NOTE_ON,
    NOTES,
    PROGRAM,
)

DEFAULT_PLACES: Mapping[int, float] = MappingProxyType({36: 0.0, 38: 0.3, 40: 0.6, 37: 0.9})
ELSEWHERE = 0.5  # of notes that the map does not name
CURVES = (0.1, 10.0)
LISTENS_TO = (0, 16)  # channels as musicians count; 0 is every one
_FULL_VELOCITY = 127.0
_CHOKING_PRESSURE = 64  # of 127
_SLOWEST_HZ, _OCTAVES = 4.0, 4.0  # of the rate's controller; the pitch's has as many octaves
_LOWEST_PITCH_HZ = 40.0
_SHORTEST_DECAY_S, _DECAY_OCTAVES = 0.1, 7.0
_LIGHTEST_KG, _MASS_OCTAVES = 0.001, 7.0
_SOFTEST_N_PER_M_P, _STIFFNESS_DECADES = 1e5, 5.0
_CENTS_PER_STEP = 4.0
_SLACKEST_GPA, _YOUNG_OCTAVES = 0.1, 7.0
_SQUARE_LAW_dB, _SOFTEST_dB = (
    40.0,
    -60.0,
)  # of the volume's, as General MIDI 2 has it; the table's lowest gain


class NoteStrike(NamedTuple):
    """Strike of a note: x in radii, level."""

    x: float
    level: float


@dataclass(frozen=True)
class NoteMap:
    """Strikes of the notes of `channel`; 0: of every channel."""

    channel: int = 0
    curve: float = 1.0
    places: Mapping[int, float] = field(default_factory=lambda: DEFAULT_PLACES)

    def strike(self, message: bytes) -> NoteStrike | None:
        """The strike that a MIDI message stands for; None for all that begins no note."""
        if len(message) != 3 or message[0] & 0xF0 != NOTE_ON or message[2] == 0:
            return None
        if self.channel not in (0, (message[0] & 0x0F) + 1):
            return None
        level = min(message[2] / _FULL_VELOCITY, 1.0) ** self.curve
        return NoteStrike(self.places.get(message[1], ELSEWHERE), level)


def request_of(message: bytes, channel: int = 0) -> tuple[str, float] | None:
    """Request of a controller's message of this channel (0: of every one), a name and a value; None for all others.

    The roll's "rate", Hz, or "level", or a parameter by its wire name.
    """
    if len(message) != 3 or message[0] & 0xF0 != CONTROL or channel not in (0, (message[0] & 0x0F) + 1):
        return None
    value = min(message[2], 127)
    share = value / _FULL_VELOCITY
    match message[1]:
        case encoding.RATE_CONTROLLER:
            return "rate", _SLOWEST_HZ * 2.0 ** (_OCTAVES * share)
        case encoding.LEVEL_CONTROLLER:
            return "level", max(share, 1.0 / _FULL_VELOCITY)
        case encoding.VOLUME_CONTROLLER:
            return "listen.gain", max(_SQUARE_LAW_dB * math.log10(max(share, 1e-9)), _SOFTEST_dB)
        case encoding.PAN_CONTROLLER:
            return "listen.pan", _from_the_middle(value)
        case encoding.MUFFLE_CONTROLLER:
            return "muffle", share
        case encoding.STRAINER_CONTROLLER:
            return "strainer", share
        case encoding.PITCH_CONTROLLER:
            return "drum.f01", _LOWEST_PITCH_HZ * 2.0 ** (_OCTAVES * share)
        case encoding.DECAY_CONTROLLER:
            return "drum.t60", _SHORTEST_DECAY_S * 2.0 ** (_DECAY_OCTAVES * share)
        case encoding.MASS_CONTROLLER:
            return "mallet.mass", _LIGHTEST_KG * 2.0 ** (_MASS_OCTAVES * share)
        case encoding.STIFFNESS_CONTROLLER:
            return "mallet.stiffness", _SOFTEST_N_PER_M_P * 10.0 ** (_STIFFNESS_DECADES * share)
        case encoding.GLIDE_CONTROLLER:
            return "tension.glide", _CENTS_PER_STEP * value
        case encoding.YOUNG_CONTROLLER:
            return "tension.young", _SLACKEST_GPA * 2.0 ** (_YOUNG_OCTAVES * share)
        case number if number in encoding.PLACE_CONTROLLERS:
            pickup, axis = divmod(encoding.PLACE_CONTROLLERS.index(number), 2)
            return f"pickup-{pickup + 1}.{'xy'[axis]}", _from_the_middle(value)
        case _:
            return None


def _from_the_middle(value: int) -> float:
    # -1 .. 1; 64 is the middle.
    return max(value - 64, -63) / 63.0


class ChokeKeys:
    """Pressure as drum pads send it: a hand that takes hold of a cymbal presses it, by polyphonic or channel pressure.

    A key chokes when its pressure comes to half of what there is, and again only after it was less, or
    after its next note: keyboards send pressure all the time. One channel's "all sound off" chokes too.
    """

    def __init__(self) -> None:
        self._pressed: set[bytes] = set()  # what the pressure is of: channel and key, or channel

    def is_choke(self, message: bytes, channel: int = 0) -> bool:
        """True when a message of this channel (0: of every one) chokes the drum."""
        if len(message) < 2 or channel not in (0, (message[0] & 0x0F) + 1):
            return False
        kind = message[0] & 0xF0
        if kind in (NOTE_ON, NOTE_OFF):  # pads that never say 0
            self._pressed.discard(bytes((message[0] & 0x0F | KEY_PRESSURE, message[1])))
        if kind == CONTROL:
            return message[1] == encoding.ALL_SOUND_OFF
        if (kind, len(message)) not in ((KEY_PRESSURE, 3), (CHANNEL_PRESSURE, 2)):
            return False
        key, was_pressed = message[:-1], message[:-1] in self._pressed
        if message[-1] < _CHOKING_PRESSURE:
            self._pressed.discard(key)
            return False
        self._pressed.add(key)
        return not was_pressed


def program_of(message: bytes, channel: int = 0) -> int | None:
    """The program, from 0, that a program change of this channel (0: of every one) names; else None."""
    if len(message) != 2 or message[0] & 0xF0 != PROGRAM or channel not in (0, (message[0] & 0x0F) + 1):
        return None
    return message[1]


def places_of(text: str) -> dict[int, float]:
    """Map of `note:x,note:x`; ValueError, worded."""
    places: dict[int, float] = {}
    for entry in text.split(","):
        note, _, x = entry.partition(":")
        try:
            number, place = int(note), float(x)
        except ValueError:
            raise ValueError(f"{entry.strip()!r}: write note:x, e.g. 36:0 or 40:0.6") from None
        if not (NOTES[0] <= number <= NOTES[1] and -1.0 <= place <= 1.0):
            raise ValueError(
                f"{entry.strip()!r}: a note is {NOTES[0]} .. {NOTES[1]}, x is -1 .. 1 of the radius"
            )
        places[number] = place
    return places
