"""A recording's file: what goes in comes out, whatever tears it; and other programs can read it."""

import errno
import json
import os
import struct
import tracemalloc
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import zstandard
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import Writer

from protocol.messages import Contact, Message, Meter, encode
from recordings import START_NS, a_strike, any_messages, channel, made
from rig.recording import channels, reading
from rig.recording.channels import CHANNELS, as_json, from_json, schema
from rig.recording.mcap_writer import CHUNK_BYTES, CHUNK_NS, McapWriter
from rig.recording.reading import RecordingError, read

NS = 1_000_000_000
_TYPES: dict[str, Any] = {
    "integer": int,
    "number": (int, float),
    "string": str,
    "boolean": bool,
    "array": list,
}


def assert_valid(found: Mapping[str, Any], described: Mapping[str, Any]) -> None:
    """Fields that the JSON schemas of recordings name; they name no more."""
    assert set(described["required"]) <= set(found) <= set(described["properties"])
    for name, value in found.items():
        row = described["properties"][name]
        assert isinstance(value, _TYPES[row["type"]])
        assert isinstance(value, bool) == (row["type"] == "boolean")
        for item in value if row["type"] == "array" else ():
            assert isinstance(item, _TYPES[row["items"]["type"]])


def whole(folder: Path, messages: list[tuple[str, Message]]) -> Path:
    path = folder / "a.mcap"
    path.unlink(missing_ok=True)
    return made(path, [(0.4 * k, topic, message) for k, (topic, message) in enumerate(messages)])


@settings(max_examples=60)
@given(any_messages())
def test_what_was_recorded_is_what_is_read(
    tmp_path_factory: pytest.TempPathFactory, messages: list[tuple[str, Message]]
) -> None:
    path = whole(tmp_path_factory.getbasetemp(), messages)
    recording = read(path)
    assert recording.torn == ""
    assert [(*channel(topic), encode(message)) for topic, message in messages] == [
        (event.channel, event.name, event.payload) for event in recording.events
    ]
    times = [(event.publish_ns, event.log_ns) for event in recording.events]
    due = [START_NS + round(0.4 * k * NS) for k in range(len(messages))]
    assert times == [(ns, ns + 700_000) for ns in due]
    assert recording.about["rig"] == "main"
    assert json.loads(recording.scenes[0])["name"] == "test"


@settings(max_examples=30)
@given(any_messages())
def test_the_libraries_own_reader_reads_it_and_its_schemas_hold(
    tmp_path_factory: pytest.TempPathFactory, messages: list[tuple[str, Message]]
) -> None:
    path = whole(tmp_path_factory.getbasetemp(), messages)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(messages)
        found = list(reader.iter_messages(log_time_order=False))
    topics: list[str] = []
    for described, told, message in found:
        assert described is not None
        assert (described.encoding, told.message_encoding) == ("jsonschema", "json")
        assert_valid(json.loads(message.data), json.loads(described.data))
        topics.append(told.topic)
    assert topics == [topic for topic, _ in messages]


@given(st.lists(st.floats(width=32, allow_nan=False, allow_infinity=False), max_size=40))
@example([1.1754943508222875e-38, 3.4028234663852886e38, 0.1, -0.0])
def test_forces_come_back_to_the_last_bit(forces: list[float]) -> None:
    packed = struct.pack(f"<{len(forces)}f", *forces)
    piece = Contact(boot=1, seq=2, first_tick=3, rate_Hz=1000.0, forces=packed)
    again = from_json(channels.CONTACT, as_json(piece))
    assert isinstance(again, Contact)
    assert again.forces == packed


@pytest.fixture(scope="module")
def roll(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A whole recording of several chunks."""
    path = tmp_path_factory.mktemp("roll") / "roll.mcap"
    return made(path, [(0.05 * k, "/strike", a_strike(k)) for k in range(200)]).read_bytes()


def _outcome(path: Path, content: bytes) -> tuple[list[int], str] | str:
    path.write_bytes(content)
    try:
        recording = read(path)
    except RecordingError as error:
        assert str(error).startswith(str(path))
        return str(error)
    return [event.publish_ns for event in recording.events], recording.torn


# A place in the file as a share of its length, which is not the same in every run.
PLACES = st.floats(0.0, 1.0, exclude_max=True)


@given(PLACES)
def test_cut_off_anywhere_it_is_read_to_its_last_whole_chunk_and_says_so(
    tmp_path_factory: pytest.TempPathFactory, roll: bytes, place: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "cut.mcap"
    everything = _outcome(path, roll)
    assert isinstance(everything, tuple)
    assert len(everything[0]) == 200
    found = _outcome(path, roll[: int(place * len(roll))])
    if isinstance(found, str):
        assert "no MCAP file" in found or "no recording of a drumstick" in found
    else:
        assert found[0] == everything[0][: len(found[0])]
        assert len(found[0]) % 20 == 0, "chunks of a second, 20 strikes each"
        assert "was cut off" in found[1]


@given(PLACES, st.integers(1, 255))
def test_a_spoilt_byte_costs_a_chunk_or_what_follows_and_never_more_than_a_clear_word(
    tmp_path_factory: pytest.TempPathFactory, roll: bytes, place: float, bits: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "spoilt.mcap"
    everything = _outcome(path, roll)
    spoilt = bytearray(roll)
    spoilt[int(place * len(roll))] ^= bits
    found = _outcome(path, bytes(spoilt))
    if isinstance(found, tuple):
        _judge(found, everything)


def _judge(found: tuple[list[int], str], everything: Any) -> None:
    # What is read was recorded, in its order. A chunk whose kind is spoilt is somebody else's record to a reader, who
    # passes it over: then the count at the end of the file says what is missing.
    rest = iter(everything[0])
    assert all(publish_ns in rest for publish_ns in found[0])
    if found[0] != everything[0]:
        assert found[1]
    if found[0] != everything[0][: len(found[0])]:
        assert found[1] == f"is damaged: {200 - len(found[0])} of 200 messages cannot be read"


def test_a_chunk_whose_kind_is_spoilt_is_missed(tmp_path: Path, roll: bytes) -> None:
    # Each kind of chunk in turn: as a record is, it is one byte ahead of its length.
    at, lost = 8, 0
    while at < len(roll) - 8:
        kind, length = roll[at], struct.unpack_from("<Q", roll, at + 1)[0]
        if kind == Opcode.CHUNK:
            found = _outcome(tmp_path / "a.mcap", roll[:at] + b"\x7f" + roll[at + 1 :])
            if lost:  # the first one declares the channels: without it nothing can be read
                assert len(found[0]) == 180
                assert found[1] == "is damaged: 20 of 200 messages cannot be read"
            lost += 1
        at += 9 + length
    assert lost == 10


def test_a_length_that_is_spoilt_is_not_waited_for(tmp_path: Path, roll: bytes) -> None:
    spoilt = bytearray(roll)
    at = roll.index(b"application/json") + len("application/json")
    spoilt[at : at + 8] = struct.pack("<Q", 2**63 + 5)
    found = _outcome(tmp_path / "a.mcap", bytes(spoilt))
    assert found[0] == []
    assert "is damaged behind byte" in found[1]


@pytest.mark.parametrize(
    ("before", "spoil", "words"),
    [
        # The record's kind: readers pass over what they do not know, and the first chunk declares the channels.
        (41, b"\x7f", "200 of 200 messages cannot be read"),
        (16, struct.pack("<Q", 2**63 - 1), "a chunk of 9223372036854775807 bytes"),
        (8, b"\0\0\0\1", "crc validation failed"),
    ],
)
def test_a_chunk_that_is_spoilt_is_missed(
    tmp_path: Path, roll: bytes, before: int, spoil: bytes, words: str
) -> None:
    spoilt = bytearray(roll)
    at = roll.index(b"zstd") - before  # opcode 1, length 8, times 16, size 8, checksum 4, length of "zstd" 4
    spoilt[at : at + len(spoil)] = spoil
    found = _outcome(tmp_path / "a.mcap", bytes(spoilt))
    assert words in found[1]


def test_zeros_behind_the_last_chunk_as_a_power_cut_leaves_them(tmp_path: Path) -> None:
    path = made(tmp_path / "a.mcap", [(0.1 * k, "/strike", a_strike(k)) for k in range(30)], finished=False)
    path.write_bytes(path.read_bytes() + bytes(5000))
    recording = read(path)
    assert len(recording.events) == 30
    assert "was cut off" in recording.torn


def test_a_chunk_is_on_the_disk_when_it_is_a_second_old_or_full(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    mcap = McapWriter(path, {})
    strike = channels.STRIKE
    mcap.put(strike, "", a_strike(1), 0, 0, 0)
    mcap.chunk_if_due(CHUNK_NS - 1)
    assert read(path).events == []
    mcap.chunk_if_due(CHUNK_NS)
    assert len(read(path).events) == 1
    count = CHUNK_BYTES // len(as_json(a_strike(2))) + 1
    for seq in range(2, count + 2):
        mcap.put(strike, "", a_strike(seq), 0, 0, CHUNK_NS)
    assert len(read(path).events) > count // 2
    mcap.finish()
    assert len(read(path).events) == count + 1


def test_what_is_there_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        McapWriter(path, {})
    assert path.read_text() == "mine"


def _foreign(path: Path, metadata: Mapping[str, str] | None, data: bytes | None = None) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        if metadata is not None:
            writer.add_metadata("drumstick", dict(metadata))
        number = writer.register_schema("x", "jsonschema", b"{}")
        strikes = writer.register_channel("/strike", "json", number)
        other = writer.register_channel("/camera", "json", number)
        writer.add_message(other, 1, b"not even JSON", 1)
        if data is not None:
            writer.add_message(strikes, 1, data, 1)
        writer.finish()
    return path


@pytest.mark.parametrize(
    ("metadata", "data", "words"),
    [
        (None, None, "no recording of a drumstick"),
        ({"format": "2"}, None, "a recording of format 2; this version reads format 1"),
        ({}, None, "a recording of format ?"),
        ({"format": "1"}, b"{", "message 1, on /strike: no JSON"),
        ({"format": "1"}, b"[1]", "message 1, on /strike: no JSON object"),
        ({"format": "1"}, b'{"boot": 1, "seq": 2}', "message 1, on /strike: Strike without t_ns, x, y"),
        (
            {"format": "1"},
            as_json(a_strike(1)).replace(b'"x":0.4', b'"x":"left"'),
            "message 1, on /strike: not a Strike: Expected `float`, got `str`",
        ),
        ({"format": "1"}, as_json(a_strike(1)).replace(b'"seq":1', b'"seq":1' + b"0" * 40), "on /strike"),
    ],
)
def test_what_is_no_recording_is_said(
    tmp_path: Path, metadata: Mapping[str, str] | None, data: bytes | None, words: str
) -> None:
    path = _foreign(tmp_path / "a.mcap", metadata, data)
    with pytest.raises(RecordingError) as error:
        read(path)
    assert words in str(error.value)
    assert str(error.value).startswith(str(path))


def test_somebody_elses_channels_are_passed_over(tmp_path: Path) -> None:
    recording = read(_foreign(tmp_path / "a.mcap", {"format": "1"}, as_json(a_strike(5))))
    assert [event.payload for event in recording.events] == [encode(a_strike(5))]


def test_a_meter_that_an_older_version_recorded_is_read() -> None:
    """It lacks what was added since."""
    meter = Meter(
        id="s", t_ns=0, sink="null", peak_left=0.5, peak_right=0.4, load=0.2, xruns=7, latency_ms=5.3, played=11,
        late=0, duplicates=0,
    )  # fmt: skip
    given = json.loads(as_json(meter))
    for name in ("revision", "waiting", "output_peak", "output_rms", "limited_frames", "clipped_frames"):
        del given[name]
    assert_valid(given, schema(channels.METER))
    assert from_json(channels.METER, json.dumps(given).encode()) == meter


@pytest.mark.parametrize("forces", [b'"1"', b'["1"]', b"[true]", b"[null]", b"[1e60]", b"{}", b"[[1]]"])
def test_forces_that_are_none(forces: bytes) -> None:
    head = b'{"boot":1,"seq":2,"first_tick":3,"rate_Hz":1000.0,"forces_N":'
    with pytest.raises(ValueError, match="forces_N"):
        from_json(channels.CONTACT, head + forces + b"}")


@pytest.mark.parametrize(
    "forces", [b"\0\0\0", struct.pack("<f", float("nan")), struct.pack("<f", float("inf"))]
)
def test_forces_that_are_no_numbers_are_not_recorded(forces: bytes) -> None:
    with pytest.raises(ValueError, match="force"):
        as_json(Contact(boot=1, seq=1, first_tick=1, rate_Hz=1e3, forces=forces))


def test_too_many_messages_are_refused_not_loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = made(tmp_path / "a.mcap", [(0.1 * k, "/strike", a_strike(k)) for k in range(12)])
    monkeypatch.setattr(reading, "_MAX_MESSAGES", 10)
    with pytest.raises(RecordingError, match="more than 10 messages"):
        read(path)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read: No such file"):
        read(tmp_path / "none.mcap")


def test_every_field_is_told_in_words_and_plain_types() -> None:
    for each in CHANNELS:
        for name, row in schema(each)["properties"].items():
            assert row["description"], name
            assert row["type"] in _TYPES, "one plain type: viewers know no unions"


@pytest.mark.parametrize(("compression", "why"), [("zstd", "not of the 100 bytes"), ("lz4", "by lz4")])
def test_a_chunk_that_would_fill_the_memory_is_not_taken_apart(
    tmp_path: Path, compression: str, why: str
) -> None:
    path = tmp_path / "bomb.mcap"
    mcap = McapWriter(path, {})
    mcap.abandon()
    size = 1 << 30
    packed = zstandard.ZstdCompressor().compressobj(size=size)
    zeros = bytes(1 << 20)
    frame = b"".join(packed.compress(zeros) for _ in range(size >> 20)) + packed.flush()
    name = compression.encode()
    chunk = struct.pack("<QQQI", 0, 0, 100, 0) + struct.pack("<I", len(name)) + name
    chunk += struct.pack("<Q", len(frame)) + frame
    with path.open("ab") as file:
        file.write(b"\x06" + struct.pack("<Q", len(chunk)) + chunk)
    tracemalloc.start()
    try:
        assert why in read(path).torn
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_a_disk_that_fills_at_the_very_end_is_one_failure(tmp_path: Path) -> None:
    mcap = McapWriter(tmp_path / "full.mcap", {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "write", _no_room)
        with pytest.raises(OSError, match="No space left"):
            mcap.finish()
    mcap.abandon()  # as the writing thread does then; what has its number now is another's
    assert read(tmp_path / "full.mcap").torn


def _no_room(_descriptor: int, _content: object) -> int:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
