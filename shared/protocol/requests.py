"""What may be asked in the payload of a `set` query: [1, value] in msgpack, or a plain JSON number or object.

JSON is for people who type at a Zenoh shell. The two never look alike: a msgpack array of two starts with
0x92, which no JSON text does. Any thread.
"""

from typing import Any, cast

import msgspec

from protocol.messages import VERSION

_JSON_START = b'-0123456789{["tfnN \t\r\n'


def _plain(payload: bytes) -> Any:
    if not payload:
        raise ValueError("empty payload: send [1, value] in msgpack, or a JSON number")
    try:
        if payload[0] in _JSON_START:
            return msgspec.json.decode(payload)
        given = msgspec.msgpack.decode(payload)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"neither msgpack nor JSON: {error}") from None
    if not isinstance(given, list):
        return given
    items = cast(list[Any], given)
    if len(items) != 2 or items[0] != VERSION:
        raise ValueError(f"expected [{VERSION}, value]")
    return items[1]


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{value!r} is not a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{value!r} is too large") from None


def requested_value(payload: bytes) -> float:
    """The number of a `set/<name>` query; ValueError says what is wrong. NaN passes: its row refuses it."""
    return _number(_plain(payload))


def requested_values(payload: bytes) -> dict[str, float]:
    """The map of a `set` query."""
    given = _plain(payload)
    if not isinstance(given, dict) or not given:
        raise ValueError("expected a map of parameter names to numbers")
    entries = cast(dict[object, object], given)
    return {str(name): _number(value) for name, value in entries.items()}
