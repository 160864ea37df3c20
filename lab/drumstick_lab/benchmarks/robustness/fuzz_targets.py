"""Readers of bytes from outside, as targets of the fuzzer. Each raises if a promise of its reader fails.

A reader may refuse, in its own documented error; any other exception is a find.
"""

import contextlib
import hashlib
import math
import re
import tempfile
from collections.abc import Callable, Iterator
from email.message import Message as Headers
from http import HTTPStatus
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote


class Target(NamedTuple):
    """One reader: `feed` takes one input, `seeds` are good ones."""

    feed: Callable[[bytes], None]
    seeds: list[bytes]


PLANTED = "planted"  # a fault on purpose: does the fuzzer find what it should?
# Modules whose branches guide the fuzzer, by target; needed before any is imported, and none with compiled kernels.
TRACED = {
    "osc": ["haptic_server.gateway.osc", "protocol.osc", "haptic_server.gateway.lease"],
    "payloads": ["protocol.messages", "protocol.requests"],
    "keys": ["protocol.pattern", "protocol.keys", "protocol.foreign_text", "protocol.endpoint"],
    "scenes": [
        "drumstick.scenes.scene_text",
        "drumstick.scenes.reading",
        "drumstick.scenes.line_numbers",
        "tomllib",
    ],
    "rig files": ["rig.identity.rig_file", "drumstick.scenes.reading", "tomllib"],
    "presets": ["haptic_server.presets.preset"],
    "recordings": ["rig.recording.reading", "rig.recording.channels", "mcap"],
    "page": ["web_panel.access.admission", "http.cookies", "urllib.parse"],
    "page messages": ["web_panel.access.client_message"],
    PLANTED: ["drumstick_lab.benchmarks.robustness.planted_fault"],
}


def _osc() -> Target:
    from osc_bench import FakeParameters, Time, opened_front
    from osc_mutants import GOOD, KILLERS, MUTANT_HOST

    parameters, time = FakeParameters(), Time()
    opened = opened_front(parameters, now=time)
    front = opened.__enter__()  # for as long as the process lives

    def feed(data: bytes) -> None:
        time.s += 1.0
        parameters.now_s += 10.0
        front.receive(data, (MUTANT_HOST, 40000))
        assert "fault" not in front.counters
        assert all(math.isfinite(value) for values, _ in parameters.sets for value in values.values())
        parameters.sets.clear()
        parameters.panics.clear()
        parameters.asked.clear()

    return Target(feed, [*GOOD, *KILLERS])


def _payloads() -> Target:
    import msgspec

    from protocol import messages, requests
    from protocol.messages import Message

    kinds = sorted((k for k in vars(messages).values() if _is_kind(k, Message)), key=lambda k: k.__name__)
    asked = (requests.requested_value, requests.requested_values, requests.requested_text)

    def feed(data: bytes) -> None:
        if not data:
            return
        which, payload = data[0] % (len(kinds) + len(asked)), data[1:]
        with contextlib.suppress(ValueError):
            if which >= len(kinds):
                asked[which - len(kinds)](payload)
                return
            message = messages.decode(payload, kinds[which])
            assert messages.decode(messages.encode(message), kinds[which]) == message

    seeds = [
        bytes((len(kinds) + 1,)) + msgspec.msgpack.encode([1, {"k_coll": 3000.0}]),
        bytes((len(kinds),)) + b"3.5",
        bytes((len(kinds) + 2,)) + msgspec.msgpack.encode([1, "slow", {"lease": "x", "revision": 3}]),
    ]
    for number, kind in enumerate(kinds):
        values = [1, *(_sample(field.type) for field in msgspec.structs.fields(kind)[1:])]
        seeds.append(bytes((number,)) + msgspec.msgpack.encode(values))
    return Target(feed, seeds)


def _is_kind(thing: object, base: type) -> bool:
    return isinstance(thing, type) and issubclass(thing, base) and thing is not base


def _sample(kind: object) -> object:
    samples = {int: 1, float: 0.5, str: "x", bool: True, bytes: b"\0\0\0\0"}
    return samples[kind] if isinstance(kind, type) and kind in samples else {"x": 0.5}


def _keys() -> Target:
    from protocol import endpoint
    from protocol.foreign_text import shown
    from protocol.keys import Keys, checked_rig
    from protocol.pattern import alive_key, checked_pattern, presence_of

    def feed(data: bytes) -> None:
        text = data.decode(errors="surrogateescape")
        line = shown(text)
        assert len(line) <= 120
        assert line.isprintable()
        found = presence_of(text)
        if found is not None:
            assert Keys(found.rig).alive(found.service, found.instance) == text
        for check in (checked_rig, checked_pattern, endpoint.host_and_port):
            with contextlib.suppress(ValueError):
                check(text)
        with contextlib.suppress(ValueError):
            alive_key(checked_pattern(text))

    return Target(
        feed,
        [b"drumstick/main/alive/sound/7", b"stage-*", b"tcp/127.0.0.1:7447", b"\x1b[2Jx\\", b"tls/[::1]:1"],
    )


def _scenes() -> Target:
    from drumstick.scenes.scene_text import (
        SceneError,
        as_tables,
        from_tables,
        parse,
        shipped_names,
        shipped_text,
    )

    def feed(data: bytes) -> None:
        with contextlib.suppress(SceneError, UnicodeDecodeError):
            scene = parse(data.decode(), "fuzz")
            assert from_tables(as_tables(scene)) == scene

    return Target(feed, [shipped_text(name).encode() for name in shipped_names()])


def _rig_files() -> Target:
    from protocol.access.roles import ROLES
    from rig.identity.rig_file import RigFileError, parse
    from rig.identity.rig_template import rig_file_text

    def feed(data: bytes) -> None:
        with contextlib.suppress(RigFileError, UnicodeDecodeError):
            parse(data.decode(), "fuzz", Path("/nonexistent"))

    return Target(feed, [rig_file_text(role, "main", "stage.local").encode() for role in ROLES])


def _presets() -> Target:
    from haptic_server.presets.preset import _FORMAT, Preset, PresetError, from_bytes, to_bytes

    def feed(data: bytes) -> None:
        # No mutant would ever meet the checksum: most inputs are given theirs.
        whole = f"{_FORMAT}{hashlib.sha256(data).hexdigest()}\n".encode() + data if data[:1] != b"d" else data
        with contextlib.suppress(PresetError):
            preset = from_bytes(whole)
            assert from_bytes(to_bytes(preset)) == preset

    good = to_bytes(Preset("slow", "roll", "2026-01-01T00:00:00+00:00", {"dv_pls": 0.1}, {"k_hand": 20.0}))
    return Target(feed, [good, good.partition(b"\n")[2]])


def _recordings() -> Target:
    from rig.recording.reading import RecordingError, read

    place = Path(tempfile.mkdtemp(prefix="drumstick-fuzz-")) / "one.mcap"

    def feed(data: bytes) -> None:
        place.write_bytes(data)
        with contextlib.suppress(RecordingError):
            read(place)

    return Target(feed, list(_some_recordings()))


def _some_recordings() -> Iterator[bytes]:
    from mcap.writer import CompressionType, Writer

    for compression in (CompressionType.NONE, CompressionType.ZSTD):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "seed.mcap"
            with path.open("wb") as stream:
                writer = Writer(stream, compression=compression)
                writer.start(profile="drumstick", library="fuzz")
                schema = writer.register_schema("drumstick.Strike", "jsonschema", b"{}")
                channel = writer.register_channel("/drumstick/strike", "json", schema)
                writer.add_metadata("drumstick", {"rig": "main"})
                writer.add_message(channel, 1, b'{"version":1,"boot":1,"seq":1}', 2)
                writer.finish()
            yield path.read_bytes()


def _page() -> Target:
    from web_panel.access.admission import Admission

    token, port = "correct-horse", 8080
    admission = Admission(token, port)

    def feed(data: bytes) -> None:
        path, *lines = data.decode("latin-1").split("\n")
        headers = Headers()
        for line in lines:
            name, _, value = line.partition(":")
            if name.isascii() and name.isprintable() and name and "\r" not in value:
                headers.add_header(name, value.strip())
        verdict = admission.judge(_Raw(headers), path)
        if verdict.status is HTTPStatus.OK:
            # What reads an address drops tabs and line breaks in it, as browsers do, and decodes %xx; a cookie may
            # have its letters in octal, or each behind a backslash.
            plain = unquote(data.decode("latin-1").replace("\r", "").replace("\t", ""))
            octal = re.sub(r"\\([0-3][0-7][0-7])", lambda found: chr(int(found[1], 8)), plain)
            meant = plain + re.sub(r"\\(.)", r"\1", octal)
            assert token in meant, "let in without the token"

    good = f"/?token={token}\nHost: 127.0.0.1:8080\nOrigin: http://127.0.0.1:8080"
    kept = f"/\nHost: localhost:8080\nCookie: drumstick_panel_{port}={token}"
    return Target(feed, [good.encode(), kept.encode(), b"/?token=wrong\nHost: evil.example\nOrigin: null"])


def _page_messages() -> Target:
    import msgspec

    from web_panel.access.client_message import (
        CAMERA_AT_FIRST,
        Check,
        ClientMessages,
        is_click,
        is_number,
        is_short_text,
    )

    checks: dict[str, Check] = {
        "slider": is_number,
        "button": is_click,
        "name": lambda v: is_short_text(v, 60),
    }
    messages = ClientMessages()
    messages.controls.update(checks)
    messages.keys.add("key")

    def feed(data: bytes) -> None:
        if not messages.admits(data):
            return
        given = msgspec.msgpack.decode(data)
        if given["type"] == "GuiUpdateMessage":
            assert given.keys() == {"type", "uuid", "updates"}
            assert given["updates"].keys() == {"value"}
            assert checks[given["uuid"]](given["updates"]["value"])
        elif given["type"] == "CommandTriggerMessage":
            assert given == {"type": "CommandTriggerMessage", "uuid": "key"}
        else:
            camera = msgspec.msgpack.decode(CAMERA_AT_FIRST)
            assert given["type"] == camera["type"]
            assert given.keys() == camera.keys()
            numbers = [
                n
                for v in given.values()
                if not isinstance(v, str)
                for n in (v if isinstance(v, list) else [v])
            ]
            assert all(math.isfinite(number) for number in numbers)

    good = [
        {"type": "GuiUpdateMessage", "uuid": "slider", "updates": {"value": 0.3}},
        {"type": "GuiUpdateMessage", "uuid": "button", "updates": {"value": True}},
        {"type": "GuiUpdateMessage", "uuid": "name", "updates": {"value": "slow"}},
        {"type": "CommandTriggerMessage", "uuid": "key"},
    ]
    return Target(feed, [CAMERA_AT_FIRST, *(msgspec.msgpack.encode(each) for each in good)])


class _Raw:
    # Headers as websockets gives them: text without decoding.
    def __init__(self, headers: Headers) -> None:
        self._headers = headers

    def get_all(self, key: str, /) -> list[str]:
        return [str(value) for value in self._headers.get_all(key) or []]


def _planted() -> Target:
    from drumstick_lab.benchmarks.robustness.planted_fault import read

    return Target(read, [b"x"])


MAKERS: dict[str, Callable[[], Target]] = {
    "osc": _osc,
    "payloads": _payloads,
    "keys": _keys,
    "scenes": _scenes,
    "rig files": _rig_files,
    "presets": _presets,
    "recordings": _recordings,
    "page": _page,
    "page messages": _page_messages,
    PLANTED: _planted,
}
