"""OSC: which addresses there are, with which types, and the bytes of everything that the rig sends.

`SENT` and `INCOMING` are the one table: the gateway's dictionary, the encoders and the documentation follow it.
Types on the wire are i, f and s only, because Pd and SuperCollider read no others. Every address stands
behind a prefix. Any thread; encoding allocates, and a strike waits for it: hence not by python-osc, whose builder
reads again what it wrote.
"""

import math
import re
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

Argument = int | float | str

DEFAULT_PREFIX = "/drumstick"
DEFAULT_IN = ("127.0.0.1", 9100)
DEFAULT_OUT = ("127.0.0.1", 9101)

MAX_FLOAT = 3.4028234663852886e38  # of 32 bits: beyond it struct raises OverflowError
_MAX_TEXT = 400
_INT, _FLOAT = struct.Struct(">i"), struct.Struct(">f")
_PREFIX = re.compile(r"(/[A-Za-z0-9_.-]{1,32}){1,4}")


@dataclass(frozen=True)
class Sent:
    """An address that the rig sends: path behind the prefix, type tags, meaning.

    `ranges` and `units`, where given, have one entry for each argument: its limits or None, its SI unit or "".
    """

    path: str
    types: str
    words: str
    ranges: tuple[tuple[float, float] | None, ...] = ()
    units: tuple[str, ...] = ()


@dataclass(frozen=True)
class Incoming:
    """An address that the rig hears; `forms`: the argument lists it may come with, "any": whatever there is."""

    path: str
    forms: tuple[str, ...]
    words: str


STRIKE = Sent(
    "/strike",
    "ifffff",
    "seq (negative: a played strike), x, y (-1..1 of the radius), speed m/s, level 0..1, expected peak force N; at the "
    "contact",
    (None, (-1.0, 1.0), (-1.0, 1.0), None, (0.0, 1.0), None),
    ("", "", "", "m/s", "", "N"),
)
RELEASE = Sent(
    "/release",
    "iffff",
    "seq, exit speed m/s, impulse N s, peak force N, contact time s",
    units=("", "m/s", "N s", "N", "s"),
)
LEVEL = Sent("/level", "f", "level of the last strike, 0..1", ((0.0, 1.0),))
X = Sent("/x", "f", "where the last strike fell, -1..1 of the radius", ((-1.0, 1.0),))
Y = Sent("/y", "f", "where the last strike fell, -1..1 of the radius", ((-1.0, 1.0),))
GATE = Sent("/gate", "i", "1 while the stick is in the head, else 0", ((0, 1),))
PARAM = Sent("/param/NAME", "f", "a parameter as the servo uses it, in SI units")
PARAM_NORM = Sent("/param/NAME/norm", "f", "the same as 0..1 of its range", ((0.0, 1.0),))
ALIVE = Sent("/alive", "ssi", "rig, state (ready, playing, panic, fault: why), strikes so far; once a second")
ERROR = Sent("/error", "ss", "the address that was refused, why")
PONG = Sent("/pong", "", "the arguments of the ping")
PRESET = Sent("/preset", "s", "the preset that was loaded, by whomever")
LEASE = Sent(
    "/lease",
    "sf",
    "who alone may set now and for how many seconds, when that changes; nobody: empty, 0",
    units=("", "s"),
)
ROLL_RATE = Sent(
    "/play/rate",
    "f",
    "rate of the roll that the values in use lead to, Hz; 0: none",
    units=("Hz",),
)
ROLL_LEVEL = Sent("/play/level", "f", "level of that roll's strikes, 0..1; 0: none", ((0.0, 1.0),))
SENT = (
    STRIKE,
    RELEASE,
    LEVEL,
    X,
    Y,
    GATE,
    PARAM,
    PARAM_NORM,
    ALIVE,
    ERROR,
    PONG,
    PRESET,
    LEASE,
    ROLL_RATE,
    ROLL_LEVEL,
)

SET = Incoming("/param/NAME", ("f", "i", ""), "set a parameter in SI units; without an argument: ask")
SET_NORM = Incoming(
    "/param/NAME/norm", ("f", "i", ""), "set it as 0..1 of its range; without an argument: ask"
)
SYNC = Incoming("/sync", ("",), "send every parameter, both forms")
PING = Incoming("/ping", ("any",), "answer /pong with the same arguments")
SUBSCRIBE = Incoming("/subscribe", ("i",), "send everything to this port of the sender's machine, for 60 s")
UNSUBSCRIBE = Incoming(
    "/unsubscribe", ("i", ""), "no longer; without an argument: every port of that machine"
)
PRESET_LOAD = Incoming("/preset/load", ("s",), "set everything that this preset holds, or nothing")
SCENE_LOAD = Incoming(
    "/scene/load", ("s",), "play another scene: a shipped one by its name, next or previous of the set list"
)
SCENE_NEXT = Incoming("/scene/next", ("", "f", "i"), "play the next scene of the set list; 0 does nothing")
SCENE_PREVIOUS = Incoming("/scene/previous", ("", "f", "i"), "play the one before; 0 does nothing")
TAKE_LEASE = Incoming(
    "/lease",
    ("s",),
    "be the only one who sets, for 5 s, under this name; again to renew; empty gives it back",
)
PLAY_STRIKE = Incoming(
    "/play/strike",
    ("fff",),
    "strike the drum without the stick: x, y (-1..1 of the radius), level 0..1",
)
PLAY_CHOKE = Incoming(
    "/play/choke",
    ("", "f", "i"),
    "stop the drum: what rings fades in 30 ms, and the next strike sounds as always; 0 does nothing",
)
PLAY_RATE = Incoming(
    "/play/rate",
    ("f", "ff", ""),
    "roll at this rate, Hz, and the level that it has; a second number: in so many seconds; without an argument: ask",
)
PLAY_LEVEL = Incoming(
    "/play/level",
    ("f", "ff", ""),
    "roll at this level, 0..1, and the rate that it has; a second number: in so many seconds; without an argument: ask",
)
PANIC = Incoming(
    "/panic",
    ("any",),
    "takes all force away from the next tick on; OSC cannot undo it: `drumstick arm` on the haptic machine",
)
INCOMING = (
    SET,
    SET_NORM,
    SYNC,
    PING,
    SUBSCRIBE,
    UNSUBSCRIBE,
    PRESET_LOAD,
    SCENE_LOAD,
    SCENE_NEXT,
    SCENE_PREVIOUS,
    TAKE_LEASE,
    PLAY_STRIKE,
    PLAY_CHOKE,
    PLAY_RATE,
    PLAY_LEVEL,
    PANIC,
)


def checked_prefix(prefix: str) -> str:
    """The prefix, when it can stand before every address; else ValueError."""
    if not _PREFIX.fullmatch(prefix):
        raise ValueError(
            f"OSC prefix {prefix!r}: write 1 to 4 parts such as /drumstick, of letters, digits, _ . or -"
        )
    return prefix


def address(prefix: str, row: Sent | Incoming, name: str = "") -> str:
    """The whole address of a row; `name` stands for NAME."""
    return prefix + row.path.replace("NAME", name)


def _int32(value: int) -> int:
    # A counter that outgrows 31 bits starts again at 0: i has 32 bits, and Pd reads no type that has 64.
    return value if -(2**31) <= value < 2**31 else value & 0x7FFFFFFF


def _float32(value: float) -> float:
    number = float(value)
    if not math.isfinite(number) or abs(number) > MAX_FLOAT:
        raise ValueError(f"{number!r} is not a finite 32-bit number")
    return number


def _text(value: str) -> bytes:
    # Ended by one to four zeros, so that what follows begins at a multiple of four bytes.
    text = value.encode("ascii", "replace")
    return text + b"\0" * (4 - len(text) % 4)


@lru_cache(512)
def _head(where: str, types: str) -> bytes:
    return _text(where) + _text("," + types)


def _argument(tag: str, value: Argument) -> bytes:
    if isinstance(value, str) != (tag == "s"):
        raise ValueError(f"{value!r} is no OSC argument of type {tag}")
    if isinstance(value, str):
        return _text(value.replace("\0", "?"))
    return _INT.pack(_int32(int(value))) if tag == "i" else _FLOAT.pack(_float32(value))


def _encode(where: str, types: str, *arguments: Argument) -> bytes:
    pairs = zip(types, arguments, strict=True)
    return _head(where, types) + b"".join([_argument(tag, value) for tag, value in pairs])


def strike(prefix: str, seq: int, x: float, y: float, speed: float, level: float, peak_N: float) -> bytes:
    """/strike; ValueError when a number is not finite, or not of the address's type (so for all encoders)."""
    return _encode(address(prefix, STRIKE), STRIKE.types, seq, x, y, speed, level, peak_N)


def release(
    prefix: str, seq: int, exit_speed: float, impulse_N_s: float, peak_N: float, contact_s: float
) -> bytes:
    """/release; the exit speed is in m/s."""
    return _encode(address(prefix, RELEASE), RELEASE.types, seq, exit_speed, impulse_N_s, peak_N, contact_s)


def level(prefix: str, value: float) -> bytes:
    """/level, the mirror of one value."""
    return _encode(address(prefix, LEVEL), LEVEL.types, value)


def x(prefix: str, value: float) -> bytes:
    """/x, the mirror of one value."""
    return _encode(address(prefix, X), X.types, value)


def y(prefix: str, value: float) -> bytes:
    """/y, the mirror of one value."""
    return _encode(address(prefix, Y), Y.types, value)


def gate(prefix: str, inside: bool) -> bytes:
    """/gate: 1 while the stick is in the head."""
    return _encode(address(prefix, GATE), GATE.types, int(inside))


def param(prefix: str, name: str, value: float) -> bytes:
    """/param/NAME."""
    return _encode(address(prefix, PARAM, name), PARAM.types, value)


def param_norm(prefix: str, name: str, norm: float) -> bytes:
    """/param/NAME/norm, clipped to 0..1: z_h0 follows from others and may lie outside its own range."""
    return _encode(address(prefix, PARAM_NORM, name), PARAM_NORM.types, min(max(_float32(norm), 0.0), 1.0))


def alive(prefix: str, rig: str, state: str, strikes: int) -> bytes:
    """/alive."""
    return _encode(address(prefix, ALIVE), ALIVE.types, rig, state[:_MAX_TEXT], strikes)


def error(prefix: str, refused: str, why: str) -> bytes:
    """/error; texts become ASCII and are cut after 400 characters."""
    return _encode(address(prefix, ERROR), ERROR.types, refused[:_MAX_TEXT], why[:_MAX_TEXT])


def pong(prefix: str, arguments: Sequence[Argument]) -> bytes:
    """/pong: texts go as s, whole numbers as i, others as f."""
    tags = ("s" if isinstance(a, str) else "i" if isinstance(a, int) else "f" for a in arguments)
    return _encode(address(prefix, PONG), "".join(tags), *arguments)


def preset(prefix: str, name: str) -> bytes:
    """/preset."""
    return _encode(address(prefix, PRESET), PRESET.types, name)


def lease(prefix: str, name: str, left_s: float) -> bytes:
    """/lease."""
    return _encode(address(prefix, LEASE), LEASE.types, name, left_s)


def roll(prefix: str, row: Sent, value: float) -> bytes:
    """/play/rate or /play/level."""
    return _encode(address(prefix, row), row.types, value)
