"""The MCAP file while it is written: channels as they come, chunks that reach the disk. The writing thread only."""

import importlib.metadata
import json
import platform
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

from mcap.writer import CompressionType, Writer

from protocol.messages import VERSION, Message
from rig.recording.channels import (
    FORMAT,
    MESSAGE_ENCODING,
    SCENE_MEDIA_TYPE,
    SCHEMA_ENCODING,
    Channel,
    as_json,
    schema,
    schema_name,
)
from rig.recording.durable_file import DurableFile
from rig.recording.index import IndexOnDisk, keep_on_disk

CHUNK_BYTES = 256 * 1024  # a chunk ends when there is so much in it, before compression
CHUNK_NS = 1_000_000_000  # or when its first message is so old
METADATA, CLOCK_METADATA = "drumstick", "clock"
SCENE_ATTACHMENT = "scene.json"


def versions() -> dict[str, str]:
    """Versions of the software that made the recording."""
    found = {name: importlib.metadata.version(name) for name in ("haptic-drumstick", "mcap", "eclipse-zenoh")}
    return {**found, "python": platform.python_version(), "wire": str(VERSION), "format": FORMAT}


class McapWriter:
    """One recording. `about`: text by name for the metadata at its start. OSError from every method: the disk is full.

    `unit_of`: the unit of a parameter, "" where nobody knows. A chunk is on the disk when the call that
    ended it returns. `count` has the messages by topic.
    """

    def __init__(
        self, path: Path, about: Mapping[str, str], unit_of: Callable[[str], str] = lambda name: ""
    ) -> None:
        self._file = DurableFile(path)
        self._unit_of = unit_of
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._chunk_since_ns: int | None = None
        self._sequence: Counter[str] = Counter()
        self.count: Counter[str] = Counter()
        self._index: IndexOnDisk | None = None
        try:
            self._writer = Writer(self._file, CHUNK_BYTES, CompressionType.ZSTD)  # pyright: ignore[reportArgumentType]
            self._index = keep_on_disk(self._writer, path.parent)
            self._writer.start("", f"haptic-drumstick {importlib.metadata.version('haptic-drumstick')}")
            self._writer.add_metadata(METADATA, {**versions(), **about})
            self._file.sync()
        except OSError:
            self.discard()
            raise

    @property
    def size(self) -> int:
        """Bytes written."""
        return self._file.size

    def note(self, name: str, facts: Mapping[str, str]) -> None:
        """A metadata record, beside the messages."""
        self._writer.add_metadata(name, dict(facts))

    def attach_scene(self, name: str, scene: bytes, at_ns: int) -> None:
        """The answer of the `scene` query; `at_ns`: wall clock."""
        self._writer.add_attachment(at_ns, at_ns, name, SCENE_MEDIA_TYPE, scene)
        self._file.sync()

    def put(
        self, channel: Channel, name: str, message: Message, log_ns: int, publish_ns: int, now_ns: int
    ) -> None:
        """One message; `name` for a channel that has many; `now_ns`: monotonic. ValueError when it is no JSON."""
        data = as_json(message)
        topic = f"{channel.topic}/{name}" if channel.many else channel.topic
        if self._chunk_since_ns is None:
            self._chunk_since_ns = now_ns
        number = self._channel(channel, topic, name)
        self._writer.add_message(number, log_ns, data, publish_ns, self._sequence[topic] & 0xFFFFFFFF)
        self._sequence[topic] += 1
        self.count[topic] += 1
        self._file.sync()  # of a chunk that this message filled; nothing otherwise
        self.chunk_if_due(now_ns)

    def chunk_due_ns(self) -> int | None:
        """Monotonic time by which the chunk in hand must be ended; None when it is empty."""
        return None if self._chunk_since_ns is None else self._chunk_since_ns + CHUNK_NS

    def chunk_if_due(self, now_ns: int) -> None:
        """End the chunk in hand if it is a second old; on the disk when this returns."""
        due_ns = self.chunk_due_ns()
        if due_ns is not None and now_ns >= due_ns:
            self._writer.flush()
            self._file.sync()
            self._chunk_since_ns = None

    def finish(self) -> None:
        """The last chunk, the index and the footer, on the disk; closes."""
        try:
            self._writer.finish()
            self._file.sync()
        finally:
            self.abandon()

    def abandon(self) -> None:
        """Close without an index, after an error: what was written stays readable to its last whole chunk."""
        self._file.close()
        if self._index is not None:
            self._index.close()

    def discard(self) -> None:
        """Close it and take it away, because there is nothing in it."""
        self.abandon()
        self._file.path.unlink()

    def _channel(self, channel: Channel, topic: str, name: str) -> int:
        known = self._channels.get(topic)
        if known is not None:
            return known
        title = schema_name(channel)
        if title not in self._schemas:
            described = json.dumps(schema(channel)).encode()
            self._schemas[title] = self._writer.register_schema(title, SCHEMA_ENCODING, described)
        facts = {"name": name, "unit": self._unit_of(name)} if channel.many else {}
        number = self._writer.register_channel(topic, MESSAGE_ENCODING, self._schemas[title], facts)
        self._channels[topic] = number
        return number
