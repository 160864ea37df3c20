"""Command-line values that the services limit, checked against the services' own ranges. Raises CommandError."""

import sys
from collections.abc import Sequence

from haptic_server.gateway.midi.encoding import CHANNELS, NOTES
from haptic_server.gateway.midi.note_map import CURVES, LISTENS_TO, places_of
from rig import extras
from rig.checks import finite
from rig.exit_status import unavailable, usage_error
from sound_server.options import SoundOptions
from sound_server.outputs import outputs_of
from sound_server.ranges import BLOCKS, MAX_DELAY_MS, MAX_RIGS, RATES_HZ, GAINS_dB


def audio(rate_Hz: int, block: int) -> None:
    """A sample rate and a block."""
    finite(rate_Hz, "--audio-rate", *RATES_HZ, "Hz")
    finite(block, "--audio-block", *BLOCKS, "frames")


def room(latency_ms: float, level_dB: float) -> None:
    """Check a room's delay and gain."""
    finite(latency_ms, "--room-latency", 0.0, MAX_DELAY_MS, "ms")
    finite(level_dB, "--room-level", *GAINS_dB, "dB")


def sound_rigs(own: str, also: Sequence[str], most: int) -> None:
    """The rigs that one sound server plays: names, and patterns with *."""
    from protocol.pattern import checked_pattern, is_pattern

    finite(most, "--most-rigs", 1, MAX_RIGS, "rigs")
    try:
        named = {own, *(checked_pattern(name) for name in also if not is_pattern(checked_pattern(name)))}
    except ValueError as error:
        usage_error(f"--also: {error}")
    if len(named) > most:
        usage_error(
            f"--rig and --also name {len(named)} rigs, more than the {most} that one sound server plays (--most-rigs,"
            f" at most {MAX_RIGS}): start another one for the rest"
        )


def outputs(text: str, own: str, also: Sequence[str]) -> None:
    """Output pairs of rigs that this sound server plays."""
    if not text:
        return
    try:
        SoundOptions(rigs=(own, *also), outputs=outputs_of(text))
    except ValueError as error:
        usage_error(f"--outputs: {error}")


def midi(port: str, note: int, channel: int) -> None:
    """A MIDI port's name, a note and a channel; the package that this takes is there."""
    _within(note, "--midi-note", NOTES, "38 is the snare of General MIDI")
    _within(channel, "--midi-channel", CHANNELS, "10 is for percussion in General MIDI")
    _midi_port("--midi-out", port)


def midi_in(port: str, notes: str, curve: float, channel: int) -> None:
    """A MIDI port's name, the places of notes, a curve of velocities and a channel."""
    if notes:
        try:
            places_of(notes)
        except ValueError as error:
            usage_error(f"--midi-in-notes {error}")
    finite(curve, "--midi-in-curve", *CURVES, "")
    _within(channel, "--midi-in-channel", LISTENS_TO, "0 is every channel")
    _midi_port("--midi-in", port)


def _midi_port(option: str, port: str) -> None:
    if not port.strip() or not port.isprintable():
        usage_error(f"{option} {port!r}: write part of a port's name, virtual, or list to see the ports")
    if port == "virtual" and sys.platform == "win32":
        unavailable(
            f"{option} virtual: Windows cannot make MIDI ports; make one with a loopback driver and name it"
        )
    extras.require(option, "midi")


def _within(number: int, option: str, span: tuple[int, int], remark: str) -> None:
    if not span[0] <= number <= span[1]:
        usage_error(f"{option} {number}: must be {span[0]} .. {span[1]} ({remark})")
