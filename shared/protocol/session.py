"""How a Zenoh session is configured: fixed endpoints, no scouting, no gossip; one router, else clients.

zenoh's default configuration opens multicast and listens on every interface; none of that is wanted on a
stage. Imports zenoh only when called.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import zenoh


def _config(settings: dict[str, object]) -> zenoh.Config:
    import zenoh

    quiet: dict[str, object] = {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
        "adminspace/enabled": False,
    }
    config = zenoh.Config()
    for key, value in {**quiet, **settings}.items():
        config.insert_json5(key, json.dumps(value))  # pyright: ignore[reportUnknownMemberType]
    return config


def client_config(endpoint: str) -> zenoh.Config:
    """A client of the router at `endpoint`, e.g. tcp/127.0.0.1:7447.

    Opening it fails after half a second without one;
    once open, it returns to a router that went away, for ever."""
    return _config(
        {
            "mode": "client",
            "connect/endpoints": [endpoint],
            "listen/endpoints": [],
            "connect/timeout_ms": 500,
            "connect/exit_on_failure": True,
            "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
        }
    )


def open_client(endpoint: str, keep_trying: Callable[[], bool]) -> zenoh.Session | None:
    """Open a client session, waiting for the router while `keep_trying()`; None when it said no.

    Any ordinary thread; blocks half a second at a time, so that a stop signal is heard. (With zenoh's own
    endless timeout `open` would not return to Python.) Close the session before the process ends, or the exit
    hangs.
    """
    import zenoh

    while keep_trying():
        try:
            return zenoh.open(client_config(endpoint))
        except zenoh.ZError:
            continue
    return None


def router_config(listen: str) -> zenoh.Config:
    """A router that listens at `listen` only; zenoh.open raises ZError when the address is taken."""
    return _config({"mode": "router", "listen/endpoints": [listen], "listen/exit_on_failure": True})


def open_router(listen: str) -> zenoh.Session:
    """Open the rig's router; OSError, worded, when the address is taken or no address at all."""
    import zenoh

    try:
        return zenoh.open(router_config(listen))
    except zenoh.ZError as error:
        raise OSError(
            f"Zenoh cannot listen at {listen} (taken by another rig?): {str(error)[:160]}"
        ) from None
