"""Cues: times at which parts of a recording go out again, and their messages by then. No I/O; any one thread.

A replay is one start of the servo: all boots of the recording become one, whose strikes are numbered on, also from one
pass of a loop to the next. Times are the events' own, so the rhythm is the recorded one whatever the network then did.
"""

from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import msgspec

from protocol.messages import Choke, Contact, Message, Readback, Release, State, Strike, decode
from rig.recording import channels
from rig.recording.channels import Channel
from rig.recording.reading import RecordedMessage

PLAYED = (
    channels.STRIKE,
    channels.RELEASE,
    channels.CHOKE,
    channels.CONTACT,
    channels.STATE,
    channels.PARAM,
)
_SHORTEST_BREATH_NS = 10_000_000
# What a servo can count to, and a replay's passes after it; far beyond, a message would hold no such number.
_MAX_OF_A_PASS, _MOST = 2**40, 2**53
_RATES_HZ = (1.0, 1e6)


class Cue(NamedTuple):
    """One message and when it goes out, ns after the beginning of a pass; `part_ns` of it since its contact began."""

    at_ns: int
    part_ns: int
    channel: Channel
    name: str
    payload: bytes


class SequenceOffsets(NamedTuple):
    """Offsets by which strikes of a recorded boot are renumbered, and how many numbers one pass takes."""

    shift: dict[int, int]
    span: int


def cues_of(events: Iterable[RecordedMessage], speed: float = 1.0) -> list[Cue]:
    """The cues of one pass, in order. `speed` moves contacts apart or together; each contact keeps its own length.

    ValueError, worded, for what no servo can have told.
    """
    found = [event for event in events if event.channel in PLAYED]
    if not found:
        return []
    begin_ns = min(event.publish_ns for event in found)
    contacts: dict[tuple[int, int], int] = {}
    cues: list[Cue] = []
    for event in sorted(found, key=lambda event: event.publish_ns):
        part_ns = 0
        _check(event)
        if event.channel is channels.CONTACT:
            piece = decode(event.payload, Contact)
            first_ns = contacts.setdefault((piece.boot, piece.seq), event.publish_ns)
            part_ns = event.publish_ns - first_ns
        at_ns = round((event.publish_ns - part_ns - begin_ns) / speed) + part_ns
        cues.append(Cue(at_ns, part_ns, event.channel, event.name, event.payload))
    if numbers_of(cues).span > _MAX_OF_A_PASS:
        raise ValueError("its strikes are numbered as by no servo, with gaps of many millions")
    return sorted(cues, key=lambda cue: cue.at_ns)


def _check(event: RecordedMessage) -> None:
    message = decode(event.payload, event.channel.kind)
    counted: tuple[int, ...] = ()
    match message:
        case Strike() | Release() | Choke():
            counted = (message.seq,)
        case State():
            counted = (message.strikes, message.revision)
        case Readback():
            counted = (message.revision,)
        case Contact():
            counted = (message.seq, message.first_tick)
            low, high = _RATES_HZ
            if not low <= message.rate_Hz <= high:
                raise ValueError(f"a contact of {message.rate_Hz:g} ticks a second: no servo has that")
        case _:
            pass
    for number in counted:
        if not 0 <= number < _MOST:
            raise ValueError(f"{event.channel.topic}: no servo counts to {number}")


def numbers_of(cues: Iterable[Cue]) -> SequenceOffsets:
    """Offsets of the strikes' numbers: those of each boot follow those of the one before."""
    lowest: dict[int, int] = {}
    highest: dict[int, int] = {}
    for cue in cues:
        if cue.channel in (channels.STRIKE, channels.RELEASE, channels.CONTACT):
            message = _decoded(cue)
            assert isinstance(message, Strike | Release | Contact)
            lowest[message.boot] = min(lowest.get(message.boot, message.seq), message.seq)
            highest[message.boot] = max(highest.get(message.boot, message.seq), message.seq)
    shift: dict[int, int] = {}
    following: int | None = None
    for boot in lowest:  # in the order of their first strikes
        shift[boot] = 0 if following is None else following - lowest[boot]
        following = highest[boot] + shift[boot] + 1
    first = min((lowest[boot] + shift[boot] for boot in lowest), default=0)
    return SequenceOffsets(shift, 0 if following is None else following - first)


def pass_ns(cues: list[Cue]) -> int:
    """Length of a pass of a loop: to its last cue, and as long again as strikes are usually apart."""
    strikes = [cue.at_ns for cue in cues if cue.channel is channels.STRIKE]
    gaps = sorted(later - earlier for earlier, later in pairwise(strikes))
    breath_ns = gaps[len(gaps) // 2] if gaps else 0
    last_ns = max((cue.at_ns for cue in cues), default=0)
    return last_ns + max(breath_ns, _SHORTEST_BREATH_NS)


class Renumbering:
    """Messages as the replay tells them: `boot` for their own, numbers shifted, times of this machine's clock."""

    def __init__(self, boot: int, numbers: SequenceOffsets) -> None:
        self._boot = boot
        self._numbers = numbers
        self._anchor_ns: int | None = None
        self._first_ticks: dict[tuple[int, int, int], int] = {}
        self._later = (
            0  # what revisions count further by: each pass, and each start of the servo, begins anew
        )
        self._revision = 0
        self._chokes = 0

    def renumbered(self, cue: Cue, begin_ns: int, turn: int) -> Message:
        """The cue's message in pass `turn` (0, 1 ...), which began at begin_ns (monotonic)."""
        message = _decoded(cue)
        at_ns = begin_ns + cue.at_ns
        match message:
            case Strike() | Release():
                return msgspec.structs.replace(
                    message, boot=self._boot, seq=self._seq(message, turn), t_ns=at_ns
                )
            case Choke():
                self._chokes += 1
                return msgspec.structs.replace(message, boot=self._boot, seq=self._chokes, t_ns=at_ns)
            case Contact():
                return self._piece(message, cue, at_ns, turn)
            case State():
                strikes = (
                    message.strikes + self._numbers.shift.get(message.boot, 0) + turn * self._numbers.span
                )
                return msgspec.structs.replace(
                    message,
                    boot=self._boot,
                    strikes=strikes,
                    t_ns=at_ns,
                    revision=message.revision + self._later,
                )
            case Readback():
                self._later = max(self._later, self._revision - message.revision)
                self._revision = message.revision + self._later
                return msgspec.structs.replace(message, revision=self._revision)
            case _:
                return message

    def _seq(self, message: Strike | Release | Contact, turn: int) -> int:
        return message.seq + self._numbers.shift[message.boot] + turn * self._numbers.span

    def _piece(self, piece: Contact, cue: Cue, at_ns: int, turn: int) -> Contact:
        # Ticks stay on one grid, that of the first contact: a listener plays all contacts on one line of ticks.
        begun_ns = at_ns - cue.part_ns
        if self._anchor_ns is None:
            self._anchor_ns = begun_ns
        key = (piece.boot, piece.seq, turn)
        if key not in self._first_ticks:
            self._first_ticks = {key: piece.first_tick, **dict(list(self._first_ticks.items())[:64])}
        grid = round((begun_ns - self._anchor_ns) * 1e-9 * piece.rate_Hz) + round(piece.rate_Hz)
        return msgspec.structs.replace(
            piece,
            boot=self._boot,
            seq=self._seq(piece, turn),
            first_tick=max(grid + piece.first_tick - self._first_ticks[key], 0),
            t_ns=None if piece.t_ns is None else at_ns,
        )


def _decoded(cue: Cue) -> Message:
    return decode(cue.payload, cue.channel.kind)
