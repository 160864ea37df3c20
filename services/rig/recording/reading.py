"""Reading a recording back, whole or torn: everything up to the last whole chunk counts. Any one thread.

The file is read from its begin to its end without its index, which one that was cut off has not.
"""

import struct
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, NamedTuple

import zstandard
from mcap.exceptions import EndOfFile, InvalidMagic, McapError
from mcap.records import Attachment, Chunk, Footer, McapRecord, Metadata, Statistics
from mcap.records import Channel as FileChannel
from mcap.records import Message as FileMessage
from mcap.stream_reader import StreamReader, breakup_chunk

from protocol.messages import encode
from realtime.regular_file import opened
from rig.recording.channels import CHANNELS, FORMAT, MESSAGE_ENCODING, Channel, channel_of, from_json
from rig.recording.mcap_writer import METADATA, SCENE_ATTACHMENT
from rig.recording.times import OLDEST_NS

_MAX_RECORD = 64 * 1024 * 1024
_MAX_MESSAGES = 5_000_000
_MAX_FILE = 8_000_000_000
_MAX_BYTES = (
    2_000_000_000  # of messages and scenes, which are all in memory: a chunk of a few kB may hold 64 MB
)
_SLACK_NS = 2_000_000_000  # between a recorder's times, whose threads and clocks are several
# What a record raises that the disk has spoilt: its checksum, its sizes, its compression, its text.
_SPOILT = (
    McapError,
    ValueError,
    ArithmeticError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,
    MemoryError,
)


class RecordingError(Exception):
    """The file is no recording that can be played: what is wrong, and where."""


class RecordedMessage(NamedTuple):
    """One message: when it happened and when it was heard (wall-clock ns), and its payload as on the wire."""

    publish_ns: int
    log_ns: int
    channel: Channel
    name: str
    payload: bytes


@dataclass
class Recording:
    """`torn`: "" for a whole file, else where and how it ends. `scenes`: JSON, the first and those that came later."""

    path: Path
    about: dict[str, str] = field(default_factory=dict[str, str])
    scenes: list[bytes] = field(default_factory=list[bytes])
    events: list[RecordedMessage] = field(default_factory=list[RecordedMessage])
    torn: str = ""
    held: int = 0  # bytes of scenes and payloads

    def of(self, channel: Channel) -> list[RecordedMessage]:
        """The events of one channel, as they happened."""
        return sorted(event for event in self.events if event.channel is channel)


class _Exact:
    # A file of which a read gives all that was asked for, or EndOfFile: mcap's own reader takes less for a whole.
    def __init__(self, file: IO[bytes]) -> None:
        self._file = file
        self.position = 0

    def read(self, size: int) -> bytes:
        if size > _MAX_RECORD:
            raise ValueError(f"a length of {size} bytes")
        found = self._file.read(size)
        if len(found) < size:
            raise EndOfFile
        self.position += size
        return found


def _records(file: IO[bytes], recording: Recording) -> Iterator[McapRecord]:
    # Every whole record, chunks taken apart; says in `torn` why there are no more.
    exact = _Exact(file)
    reader = StreamReader(exact, emit_chunks=True, record_size_limit=_MAX_RECORD)  # pyright: ignore[reportArgumentType]
    whole_to, ended = 0, False
    try:
        for record in reader.records:
            yield from _within(record) if isinstance(record, Chunk) else (record,)
            whole_to, ended = exact.position, isinstance(record, Footer)
    except InvalidMagic:
        if not ended:
            raise RecordingError(f"{recording.path}: no MCAP file") from None
        recording.torn = f"is damaged at byte {whole_to}, behind its last message"
    except EndOfFile:
        if exact.position < 8:
            raise RecordingError(f"{recording.path}: no MCAP file") from None
        recording.torn = f"was cut off: whole to byte {whole_to} of {exact.position}"
    except _SPOILT as error:
        recording.torn = f"is damaged behind byte {whole_to} ({error}): what follows is left out"


def _within(chunk: Chunk) -> list[McapRecord]:
    if chunk.uncompressed_size > _MAX_RECORD:
        raise ValueError(f"a chunk of {chunk.uncompressed_size} bytes")
    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"a chunk compressed by {chunk.compression[:20]}; zstd is read, or none")
    # What is compressed has a size of its own, and it is that one which is believed when it is taken apart.
    if chunk.compression and zstandard.frame_content_size(chunk.data) != chunk.uncompressed_size:
        raise ValueError(f"a chunk that is not of the {chunk.uncompressed_size} bytes that it says")
    return breakup_chunk(chunk, validate_crc=True)


def read(path: Path, wanted: Collection[Channel] = CHANNELS) -> Recording:
    """The events of the wanted channels, in the order of the file. RecordingError, worded."""
    recording = Recording(path)
    names: dict[int, tuple[Channel, str]] = {}
    formats: list[str] = []
    declared: set[int] = set()
    found, counted = 0, 0
    try:
        with opened(path, _MAX_FILE) as file:
            for record in _records(file, recording):
                if isinstance(record, FileChannel):
                    declared.add(record.id)
                found += isinstance(record, FileMessage) and record.channel_id in declared
                match record:
                    case Statistics():
                        counted = record.message_count
                    case Metadata() if record.name == METADATA:
                        recording.about = dict(record.metadata)
                        formats.append(recording.about.get("format", "?"))
                    case Attachment() if record.name == SCENE_ATTACHMENT:
                        _hold(recording, record.data)
                        recording.scenes.insert(0, record.data)
                    case Attachment() if record.name.startswith("scene-"):
                        _hold(recording, record.data)
                        recording.scenes.append(record.data)
                    case FileChannel() if record.message_encoding == MESSAGE_ENCODING:
                        known = channel_of(record.topic)
                        if known is not None and known[0] in wanted:
                            names[record.id] = known
                    case FileMessage() if record.channel_id in names:
                        _take(recording, record, *names[record.channel_id])
                    case _:
                        pass  # an index, or somebody else's
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
    if (
        not recording.torn and found < counted
    ):  # a chunk whose very kind is spoilt is passed over without a word
        recording.torn = f"is damaged: {counted - found} of {counted} messages cannot be read"
    if not formats:
        raise RecordingError(f"{path}: no recording of a drumstick: it has no metadata of that name")
    if formats[0] != FORMAT:
        raise RecordingError(
            f"{path}: a recording of format {formats[0]}; this version reads format {FORMAT}"
        )
    return recording


def _take(recording: Recording, record: FileMessage, channel: Channel, name: str) -> None:
    if len(recording.events) >= _MAX_MESSAGES:
        raise RecordingError(f"{recording.path}: more than {_MAX_MESSAGES} messages: cut it")
    try:
        payload = encode(from_json(channel, record.data))
        _check_times(recording, record)
    except ValueError as error:
        place = f"{recording.path}: message {len(recording.events) + 1}, on {channel.topic}"
        raise RecordingError(f"{place}: {error}") from None
    _hold(recording, payload)
    recording.events.append(RecordedMessage(record.publish_time, record.log_time, channel, name, payload))


def _check_times(recording: Recording, record: FileMessage) -> None:
    # The file's order is that in which messages were heard; one may have been under way for long, and a recorder has
    # several threads. ValueError for what no recorder writes.
    back_ns = recording.events[-1].log_ns - record.log_time if recording.events else 0
    if back_ns > _SLACK_NS:
        raise ValueError(
            f"its time goes back: it was recorded {back_ns / 1e9:g} s before the message ahead of it"
        )
    age_ns = record.log_time - record.publish_time
    if not -_SLACK_NS <= age_ns <= OLDEST_NS + _SLACK_NS:
        when = f"{abs(age_ns) / 1e9:g} s {'before' if age_ns > 0 else 'after'} it was recorded"
        raise ValueError(f"its times do not fit: it happened {when}")


def _hold(recording: Recording, content: bytes) -> None:
    recording.held += len(content)
    if recording.held > _MAX_BYTES:
        raise RecordingError(f"{recording.path}: more than {_MAX_BYTES} bytes of messages: cut it")
