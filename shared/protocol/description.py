"""Description of the wires as one table for programs: the reference pages, the JSON and OSCQuery follow it.

The OSC half is `protocol.osc`; the words of a Zenoh key are its docstring in `protocol.keys`. Any thread.
"""

import inspect
from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec

from drumstick.scenes.table import Parameter
from protocol import messages, osc
from protocol.keys import Keys


class Use(NamedTuple):
    """Use of a key: `payload` is what is put or answered (None: JSON), `asked` what a query carries."""

    member: str  # of Keys
    kind: str  # put, query, put and query, token
    payload: type[messages.Message] | None
    asked: str = ""


_SET = "[1, value] or [1, value, claim], or a JSON number"
_SET_MANY = "[1, {name: value}] or [1, {name: value}, claim], or a JSON object"
_NAME = "[1, name] or [1, name, claim], or a JSON text"
_NAMES = "[1, [name, new name]] or [1, [name, new name], claim], or a JSON list of both"
_PLAY = "[1, [x, y, level]], [1, [x, y, level, name]], either with a claim, or [x, y, level] as JSON"
_CHOKE = "nothing, [1, name] of whoever plays, with a claim, or the name as a JSON text"
_WISH = "nothing, or [1, value], [1, [value, seconds]], either with a claim, or the value as JSON"
_ROLL = "[1, {rate: Hz, level: 0 .. 1, seconds: s}], with a claim, or a JSON object; any may be left out"
ZENOH = (
    Use("strike", "put", messages.Strike),
    Use("release", "put", messages.Release),
    Use("choke", "put", messages.Choke),
    Use("contact", "put", messages.Contact),
    Use("state", "put", messages.State),
    Use("set_one", "query", messages.Readback, _SET),
    Use("set_many", "query", messages.SetReply, _SET_MANY),
    Use("param", "put and query", messages.Readback),
    Use("preset", "put and query", messages.PresetNews),
    Use("preset_load", "query", messages.PresetReply, _NAME),
    Use("preset_save", "query", messages.PresetNews, "[1, name], or a JSON text"),
    Use("preset_rename", "query", messages.PresetNews, _NAMES),
    Use("preset_delete", "query", messages.PresetNews, _NAME),
    Use("lease", "put and query", messages.Lease, "LeaseRequest, or nothing"),
    Use("play_strike", "query", messages.Strike, _PLAY),
    Use("play_choke", "query", messages.Choke, _CHOKE),
    Use("play_rate", "put and query", messages.Readback, _WISH),
    Use("play_level", "put and query", messages.Readback, _WISH),
    Use("play_roll", "query", messages.SetReply, _ROLL),
    Use("scene", "query", None),
    Use("scene_load", "query", messages.Message, _NAME),
    Use("clock", "query", messages.Clock),
    Use("doctor", "query", None),
    Use("door", "query", None),
    Use("panic", "query", messages.Message),
    Use("pointer", "put", messages.Pointer),
    Use("meter", "put", messages.Meter),
    Use("membrane", "put", messages.Membrane),
    Use("spectrum", "put", messages.Spectrum),
    Use("cost", "put", messages.Cost),
    Use("alive", "token", None),
)


def key_of(use: Use, rig: str) -> str:
    """The whole key, with NAME, SERVICE and ID where they stand."""
    member = getattr(Keys(rig), use.member)
    if isinstance(member, str):
        return member
    return member(*(("SERVICE", "ID") if use.member == "alive" else ("NAME",)))


def words_of(thing: object) -> str:
    """The first paragraph of a docstring, on one line."""
    return " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())


def words_of_key(use: Use) -> str:
    """Purpose of a key."""
    member = vars(Keys)[use.member]
    return words_of(member.fget if isinstance(member, property) else member)


def described(
    table: Mapping[str, Parameter], rig: str = "RIG", prefix: str = osc.DEFAULT_PREFIX
) -> dict[str, Any]:
    """Everything, for `json.dumps`: keys, payloads (JSON Schema of the msgpack arrays), addresses, parameters."""
    kinds = [messages.RefusalReply, messages.LeaseRequest, *(use.payload for use in ZENOH if use.payload)]
    _, schemas = msgspec.json.schema_components(dict.fromkeys(kinds), ref_template="#/payloads/{name}")
    for kind in kinds:  # JSON Schema has no names for the places of an array
        schemas[kind.__name__]["fields"] = list(kind.__struct_fields__)
    return {
        "version": messages.VERSION,
        "zenoh": {
            "encoding": messages.ENCODING,
            "keys": [
                {
                    "key": key_of(use, rig),
                    "kind": use.kind,
                    "payload": use.payload.__name__ if use.payload else "",
                    "query": use.asked,
                    "description": words_of_key(use),
                }
                for use in ZENOH
            ],
            "error_reply": messages.RefusalReply.__name__,
        },
        "payloads": schemas,
        "osc": {
            "sent": [
                {"address": prefix + row.path, "types": row.types, "description": row.words}
                for row in osc.SENT
            ],
            "heard": [
                {"address": prefix + row.path, "types": list(row.forms), "description": row.words}
                for row in osc.INCOMING
            ],
        },
        "parameters": [
            {
                "name": name,
                "symbol": row.quantity.symbol,
                "unit": row.quantity.unit,
                "low": row.quantity.low,
                "high": row.quantity.high,
                "scale": row.quantity.scale,
                "equation": row.quantity.equation,
                "description": row.quantity.words,
                "osc": [
                    osc.address(prefix, osc.PARAM, name),
                    osc.address(prefix, osc.PARAM_NORM, name),
                ],
            }
            for name, row in table.items()
        ],
    }
