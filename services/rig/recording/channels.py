"""Channels of a recording: the wire's messages as JSON objects, and the JSON schema of each.

One table, `CHANNELS`; writer, reader and docs/recordings.md follow it. A JSON object has the fields of its message, but
for the version, under their names; `forces` of a contact are numbers, `forces_N`. Fields that are None are left out.
One that has a default may be missing: an older version wrote none. Any thread.
"""

import functools
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast, get_args, get_origin

import msgspec
import numpy as np

from protocol.messages import (
    VERSION,
    Choke,
    Contact,
    Message,
    Meter,
    Readback,
    Release,
    State,
    Strike,
    decode,
)

FORMAT = "1"  # of the recording: another one is not read
MESSAGE_ENCODING, SCHEMA_ENCODING = "json", "jsonschema"  # well-known names of the MCAP specification
SCENE_MEDIA_TYPE = "application/json"


class Presence(Message, array_like=True, frozen=True, kw_only=True):
    """A service came (`alive`) or went, by its liveliness token alive/SERVICE/ID. Made by the recorder."""

    service: str
    id: str
    alive: bool


@dataclass(frozen=True)
class Channel:
    """A topic and what its messages are, in words; `many`: one channel for each name, TOPIC/NAME."""

    topic: str
    kind: type[Message]
    words: str
    many: bool = False


STRIKE = Channel("/strike", Strike, "The stick met the head")
RELEASE = Channel("/release", Release, "The stick left the head again; `seq` is that of its strike")
CHOKE = Channel("/choke", Choke, "A player stopped the drum")
CONTACT = Channel("/contact", Contact, "A piece of one contact's force; `seq` is that of its strike")
STATE = Channel("/state", State, "How the servo stands")
METER = Channel("/meter", Meter, "How a sound server stands")
PARAM = Channel("/param", Readback, "A parameter as the servo uses it", many=True)
ALIVE = Channel("/alive", Presence, "A service came or went")
CHANNELS = (STRIKE, RELEASE, CHOKE, CONTACT, STATE, METER, PARAM, ALIVE)

_FORCES, _FORCES_JSON = "forces", "forces_N"
_JSON_TYPES: dict[type, str] = {int: "integer", float: "number", str: "string", bool: "boolean"}

# What a field is, in words; units are in its name, or here.
WORDS: dict[str, str] = {
    "boot": "number of one start of the servo; that of played strikes is one of the gateway",
    "seq": "number of the strike since that start; of a choke: its own",
    "t_ns": "the event's instant, ns of the haptic machine's monotonic clock",
    "x": "place, -1..1 of the head's radius",
    "y": "place, -1..1 of the head's radius",
    "z_speed_m_per_s": "speed at the contact, downward, m/s",
    "level": "strength of the strike, 0..1: from its speed, by the scene's curve ([strike])",
    "peak_estimate_N": "expected peak force, N",
    "contact_estimate_s": "expected time in the head, s",
    "exit_speed_m_per_s": "speed at which the stick left, m/s",
    "impulse_N_s": "impulse of the contact (in /strike: the expected one), N s",
    "source": "what made the strike; `stick` for the rig's own, else who played it, or choked the drum",
    "peak_N": "peak force, N",
    "contact_s": "time in the head, s",
    "first_tick": "servo tick of the first force, counted since the servo's start",
    "rate_Hz": "ticks a second, Hz",
    "forces_N": "mean force over each tick, N; 0 closes a contact",
    "status": "ready, playing, panic or fault: why",
    "arrival_ms": "from a contact to its strike's arrival, median of the newest, ms",
    "jitter_ms": "arrival jitter: 95th less 5th percentile of the newest 256 strikes, ms",
    "waiting": "what is set and does not sound yet, or cannot, in words",
    "unpunctual": "strikes that came after the instant at which they should have sounded",
    "z_m": "height of the stick above the head, m",
    "v_m_per_s": "speed of the stick, upward, m/s",
    "force_N": "force on the stick, N",
    "roll_rate_Hz": "strikes a second, Hz",
    "v_e_m_per_s": "upward speed after the last contact and pulse, m/s",
    "strikes": "strikes since the servo's start",
    "ticks": "servo ticks since its start",
    "overruns": "ticks that came too late to be run",
    "lateness_p99_us": "99th percentile of the ticks' lateness, us",
    "lateness_worst_us": "largest lateness of a tick, us",
    "ring_dropped": "events that the gateway was too late for",
    "next_scene": "the scene that is made ready meanwhile; empty: none",
    "scene_refusal": "why the scene that was asked for last is not played; empty: it is",
    "revision": "number of the parameter set in use",
    "pending": "whether an accepted set waits for the stick to be above the head",
    "id": "which process",
    "sink": "where the sound goes",
    "peak_left": "peak level of this rig's drum, 1 is full scale",
    "peak_right": "peak level of this rig's drum, 1 is full scale",
    "output_peak": "peak level of all that leaves by this sink, 1 is full scale",
    "output_rms": "rms level of its loudest channel, as slow as a VU meter; 1 is full scale, a sine of it 0.707",
    "limited_frames": "frames that the limiter bent, since the sink was opened",
    "clipped_frames": "those of them that left at full scale",
    "load": "share of a block's time that the sound took, 0..1",
    "xruns": "blocks that came too late",
    "latency_ms": "delay from an audio block to the loudspeaker, as the driver says, with the interpolator, ms",
    "played": "strikes or contacts played",
    "late": "strikes or pieces that came too late",
    "duplicates": "strikes or pieces that came twice",
    "underflows": "gaps of a streamed force that were bridged",
    "refused": "messages that held nonsense",
    "value": "what the servo uses, in the parameter's unit (the channel's metadata name it)",
    "service": "haptic, sound, panel, pointer, record",
    "alive": "whether it came or went",
}


def _fields(kind: type[Message]) -> tuple[str, ...]:
    return kind.__struct_fields__[1:]  # all but the version


def _defaults(kind: type[Message]) -> dict[str, Any]:
    # Of the fields that a recording of an older version may lack.
    found = {field.name: field.default for field in msgspec.structs.fields(kind)[1:]}
    return {name: default for name, default in found.items() if default is not msgspec.NODEFAULT}


def _name(field: str) -> str:
    return _FORCES_JSON if field == _FORCES else field


def _property(field: str, annotation: Any) -> dict[str, Any]:
    words = {"description": WORDS[_name(field)]}
    if annotation is bytes:
        return {"type": "array", "items": {"type": "number"}, **words}
    return {"type": _JSON_TYPES[annotation], **words}


def _required(annotation: Any) -> Any:
    # The type of an optional field: viewers know no unions.
    if get_origin(annotation) is types.UnionType:
        (annotation,) = (kind for kind in get_args(annotation) if kind is not types.NoneType)
    return annotation


def schema_name(channel: Channel) -> str:
    """Name of the channel's schema in the file."""
    return f"drumstick.{channel.kind.__name__}"


@functools.cache
def schema(channel: Channel) -> dict[str, Any]:
    """The JSON schema of a channel's messages: plain types only, so that viewers need no plugin."""
    hints = typing.get_type_hints(channel.kind)
    optional = _defaults(channel.kind)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": schema_name(channel),
        "description": channel.words,
        "type": "object",
        "properties": {
            _name(field): _property(field, _required(hints[field])) for field in _fields(channel.kind)
        },
        "required": [_name(field) for field in _fields(channel.kind) if field not in optional],
    }


def _numbers(forces: bytes) -> list[float]:
    # The shortest decimal that is the same float32 again: half the size of its double's.
    if len(forces) % 4:
        raise ValueError(f"{len(forces)} bytes of forces: a float32 has 4")
    found: list[float] = []
    for force in np.frombuffer(forces, "<f4"):
        short = float(str(force))
        found.append(short if np.float32(short) == force else float(force))
    if not np.isfinite(found).all():
        raise ValueError("a force is not finite")
    return found


def as_json(message: Message) -> bytes:
    """The message as the JSON object of its channel. ValueError when it cannot be one: forces that are no numbers."""
    fields: dict[str, Any] = {}
    for field in _fields(type(message)):
        value = getattr(message, field)
        if field == _FORCES:
            fields[_FORCES_JSON] = _numbers(value)
        elif value is not None:
            fields[field] = value
    return msgspec.json.encode(fields)


def from_json(channel: Channel, data: bytes) -> Message:
    """The message again. ValueError, worded, for anything that `as_json` does not write."""
    try:
        given: Any = msgspec.json.decode(data)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"no JSON: {error}") from None
    if not isinstance(given, Mapping):
        raise ValueError("no JSON object")
    table = cast(Mapping[str, Any], given)
    required = schema(channel)["required"]
    missing = [name for name in required if name not in table]
    if missing:
        raise ValueError(f"{channel.kind.__name__} without {', '.join(missing)}")
    defaults = _defaults(channel.kind)
    values = [table.get(_name(field), defaults.get(field)) for field in _fields(channel.kind)]
    if channel is CONTACT:
        at = _fields(Contact).index(_FORCES)
        values[at] = _floats(values[at])
    try:
        return decode(msgspec.msgpack.encode([VERSION, *values]), channel.kind)
    except (OverflowError, TypeError) as error:
        raise ValueError(f"not a {channel.kind.__name__}: {error}") from None


def _floats(numbers: Any) -> bytes:
    if not isinstance(numbers, list) or not all(type(n) in (int, float) for n in cast(list[Any], numbers)):
        raise ValueError(f"{_FORCES_JSON} are no list of numbers")
    with np.errstate(over="ignore"):
        forces = np.array(numbers, np.float64).astype("<f4")
    if not np.isfinite(forces).all():
        raise ValueError(f"{_FORCES_JSON} hold what is no 32-bit number")
    return forces.tobytes()


def channel_of(topic: str) -> tuple[Channel, str] | None:
    """The channel of a recorded topic and the name behind it ("" for most); None for a topic of somebody else's."""
    for channel in CHANNELS:
        if topic == channel.topic and not channel.many:
            return channel, ""
        if channel.many and topic.startswith(channel.topic + "/"):
            return channel, topic.removeprefix(channel.topic + "/")
    return None
