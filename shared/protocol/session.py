"""How a Zenoh session is configured: fixed endpoints, no scouting, no gossip; one router, everything else a client.

zenoh's default configuration opens multicast and listens on every interface; none of that is wanted on a stage.
Imports zenoh only when called.
"""

from __future__ import annotations

import json
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
        config.insert_json5(key, json.dumps(value))
    return config


def client_config(endpoint: str) -> zenoh.Config:
    """A client of the router at `endpoint`, e.g. tcp/127.0.0.1:7447: waits for it, and returns to it, for ever."""
    return _config(
        {
            "mode": "client",
            "connect/endpoints": [endpoint],
            "listen/endpoints": [],
            "connect/timeout_ms": -1,
            "connect/exit_on_failure": False,
            "connect/retry": {"period_init_ms": 100, "period_max_ms": 500, "period_increase_factor": 1.5},
        }
    )


def router_config(listen: str) -> zenoh.Config:
    """A router that listens at `listen` only; zenoh.open raises ZError when the address is taken."""
    return _config({"mode": "router", "listen/endpoints": [listen], "listen/exit_on_failure": True})
