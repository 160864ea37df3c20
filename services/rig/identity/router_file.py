"""A configuration file of Zenoh's own router, `zenohd`, for a machine of its own: JSON5, from the table of roles.

It is made for a folder that `drumstick keys make --router HOST` makes: `zenohd -c router.json5`, started there.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import cast

from protocol.access.identity import Identity, as_client, as_listener
from protocol.access.roles import ROLES
from protocol.access.router import Crossing, router_access
from protocol.session import MAX_MESSAGE_BYTES, SLOW_READER_US
from rig.identity.rig_template import PUBLIC_PORT

_LINE = 110  # columns
_QUIET: dict[str, object] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/shared_memory/enabled": False,
    "adminspace/enabled": False,
}


def venue_router(
    identity: Identity,
    rigs: Sequence[str],
    roles: Sequence[str] = tuple(ROLES),
    far: str | None = None,
    crossing: Crossing | None = None,
    listen: str = f"tls/0.0.0.0:{PUBLIC_PORT}",
) -> dict[str, object]:
    """Nested settings: a router over TLS that everybody comes to, the gateway too; `far` is another venue's router."""
    flat: dict[str, object] = {
        "mode": "router",
        "listen/endpoints": [listen],
        **_QUIET,
        **as_listener(identity),
        "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": SLOW_READER_US,
        "access_control": router_access(rigs, roles, crossing),
    }
    if far is not None:
        flat |= as_client(identity)
        flat |= {
            "connect/endpoints": [far],
            "connect/timeout_ms": -1,
            "connect/exit_on_failure": False,
            "connect/retry": {"period_init_ms": 1000, "period_max_ms": 5000, "period_increase_factor": 1.5},
        }
    return nested(flat)


def browser_router(router: str, identity: Identity, websocket: str) -> dict[str, object]:
    """Nested settings: a client of the venue's router whose plugin speaks to zenoh-ts in browsers of this machine."""
    flat: dict[str, object] = {
        "mode": "client",
        "connect/endpoints": [router],
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
        "listen/endpoints": [],
        **_QUIET,
        **as_client(identity),
        "plugins_loading/enabled": True,
        "plugins": {"remote_api": {"__required__": True, "websocket_port": websocket}},
    }
    return nested(flat)


def nested(flat: dict[str, object]) -> dict[str, object]:
    """{"a/b": 1} as {"a": {"b": 1}}."""
    found: dict[str, object] = {}
    for path, value in flat.items():
        *folders, name = path.split("/")
        place: dict[str, object] = found
        for folder in folders:
            inner = place.setdefault(folder, {})
            assert isinstance(inner, dict)
            place = inner  # pyright: ignore[reportUnknownVariableType]
        place[name] = value
    return found


def text(words: Sequence[str], settings: dict[str, object]) -> str:
    """The file: `words` as comments above the settings; a rule of access a line."""
    return "".join(f"// {line}\n" for line in words) + _laid_out(settings, "") + "\n"


def _laid_out(value: object, indent: str) -> str:
    # json.dumps gives each word of a list a line of its own: a thousand lines of rules.
    flat = json.dumps(value)
    if len(flat) + len(indent) <= _LINE or not isinstance(value, dict | list):
        return flat
    inner = indent + "  "
    if isinstance(value, dict):
        items = cast(dict[str, object], value).items()
        rows = [f"{inner}{json.dumps(name)}: {_laid_out(each, inner)}" for name, each in items]
        return "{\n" + ",\n".join(rows) + f"\n{indent}}}"
    rows = [inner + json.dumps(each) for each in cast(list[object], value)]
    return "[\n" + ",\n".join(rows) + f"\n{indent}]"
