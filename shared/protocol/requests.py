"""Payloads of queries: [1, value] or [1, value, claim] in msgpack, or plain JSON.

JSON is for people who type at a Zenoh shell. The two never look alike: a msgpack array of two starts with
0x92, one of three with 0x93, which no JSON text does. Any thread.
"""

from typing import Any, NamedTuple, cast

import msgspec

from protocol.messages import VERSION

_MAX_NAME = 40
_JSON_START = b'-0123456789{["tfnN \t\r\n'


class Claim(NamedTuple):
    """Conditions of a set: `lease` is the secret of who sets, `revision` the newest set they know."""

    lease: str = ""
    revision: int | None = None


ANYBODY = Claim()


def _claim(given: object) -> Claim:
    if not isinstance(given, dict):
        raise ValueError('a claim is a map such as {"lease": "...", "revision": 3}')
    entries = cast(dict[object, object], given)
    lease, revision = entries.get("lease", ""), entries.get("revision")
    if (
        not isinstance(lease, str)
        or isinstance(revision, bool)
        or not isinstance(revision, (int, type(None)))
    ):
        raise ValueError("a claim's lease is a text and its revision a whole number")
    if entries.keys() - set(Claim._fields):
        raise ValueError(f"a claim has {' and '.join(Claim._fields)}, nothing else")
    return Claim(lease, revision)


def _plain(payload: bytes) -> tuple[Any, Claim]:
    if not payload:
        raise ValueError("empty payload: send [1, value] in msgpack, or plain JSON")
    try:
        if payload[0] in _JSON_START:
            return msgspec.json.decode(payload), ANYBODY
        given = msgspec.msgpack.decode(payload)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"neither msgpack nor JSON: {error}") from None
    if not isinstance(given, list):
        return given, ANYBODY
    items = cast(list[Any], given)
    if len(items) not in (2, 3) or items[0] != VERSION:
        raise ValueError(f"expected [{VERSION}, value], or [{VERSION}, value, claim]")
    return items[1], _claim(items[2]) if len(items) == 3 else ANYBODY


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{value!r} is not a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{value!r} is too large") from None


def requested_value(payload: bytes) -> tuple[float, Claim]:
    """The number of a `set/<name>` query; ValueError says what is wrong. NaN passes: its row refuses it."""
    value, claim = _plain(payload)
    return _number(value), claim


def requested_values(payload: bytes) -> tuple[dict[str, float], Claim]:
    """The map of a `set` query."""
    given, claim = _plain(payload)
    if not isinstance(given, dict) or not given:
        raise ValueError("expected a map of parameter names to numbers")
    entries = cast(dict[object, object], given)
    return {str(name): _number(value) for name, value in entries.items()}, claim


class StrikeRequest(NamedTuple):
    """A strike to be played: place in radii, level, and who plays it ("": somebody)."""

    x: float
    y: float
    level: float
    name: str = ""


def requested_strike(payload: bytes) -> StrikeRequest:
    """The strike of a `play/strike` query; its numbers may be any, NaN too. It needs no claim."""
    given, _ = _plain(payload)
    items = cast(list[object], given) if isinstance(given, list) else list[object]()
    name = items[3] if len(items) == 4 else ""
    if len(items) not in (3, 4) or not isinstance(name, str):
        raise ValueError("expected x, y, level and perhaps a name")
    _check_player(name)
    x, y, level = (_number(value) for value in items[:3])
    return StrikeRequest(x, y, level, name)


def _check_player(name: str) -> None:
    if not name.isprintable() or len(name) > _MAX_NAME:
        raise ValueError(f"a player's name has at most {_MAX_NAME} printable characters")


def requested_choke(payload: bytes) -> str:
    """Name of who chokes in a `play/choke` query ("": somebody). It needs no claim."""
    name = requested_text(payload)[0] if payload else ""
    _check_player(name)
    return name


class RollRequest(NamedTuple):
    """A roll to be played: rate Hz and level 0 .. 1, None: as it is; in how many seconds."""

    rate: float | None = None
    level: float | None = None
    seconds: float = 0.0


def requested_way(payload: bytes) -> tuple[float, float, Claim]:
    """Value and seconds of a `play/rate` or `play/level` query; its numbers may be any, NaN too."""
    given, claim = _plain(payload)
    items = cast(list[object], given) if isinstance(given, list) else [given]
    if len(items) not in (1, 2):
        raise ValueError("expected a value, or a value and seconds")
    value, seconds = _number(items[0]), _number(items[1]) if len(items) == 2 else 0.0
    return value, seconds, claim


def requested_roll(payload: bytes) -> tuple[RollRequest, Claim]:
    """The roll of a `play/roll` query; its numbers may be any, NaN too."""
    values, claim = requested_values(payload)
    if values.keys() - set(RollRequest._fields) or not values.keys() & {"rate", "level"}:
        raise ValueError("expected a map with rate, level or both, and perhaps seconds")
    return RollRequest(**values), claim


def requested_text(payload: bytes) -> tuple[str, Claim]:
    """The name of a `preset/load`, `preset/save`, `preset/delete` or `play/choke` query."""
    given, claim = _plain(payload)
    if not isinstance(given, str):
        raise ValueError("expected a name as text")
    return given, claim


def requested_names(payload: bytes) -> tuple[str, str, Claim]:
    """The present and the new name of a `preset/rename` query."""
    given, claim = _plain(payload)
    match given:
        case [str(name), str(new)]:
            return name, new, claim
        case _:
            raise ValueError("expected the present and the new name, as two texts")
