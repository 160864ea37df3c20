"""Settings of a Zenoh session: fixed endpoints, no scouting, no gossip; one router, else clients.

zenoh's default configuration opens multicast and listens on every interface; none of that is wanted on a
stage. A router listens on a loopback address for this machine's processes; on a public one only over TLS, for
certificates of the rig's authority, each with the rights of its role. Imports zenoh only when called.
"""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

from protocol.access.identity import Identity, as_client, as_listener
from protocol.access.rules import access_control
from protocol.endpoint import is_tls

if TYPE_CHECKING:
    import zenoh

_log = logging.getLogger("zenoh")
_REFUSED_AGAIN_S = 3.0  # each failed handshake holds up everybody else's joining for 0.1 s
_TURN_S = 0.1
# How often a client of this machine looks for a router that is gone, s.
RETRY_S = 0.1
# Nothing here is larger than a scene's text; Zenoh's own limit is 1 GB, in the memory of the receiver.
MAX_MESSAGE_BYTES = 4_000_000
# Of one link of the public listener: so much is still acted on after the link was ended for going beyond a limit.
UNREAD_BYTES = 8192
# A reply that finds a full queue waits so long for its reader, and then closes the link.
SLOW_READER_US = 1_000_000
# A network that is not there yet: the public listener is tried again.
_TRIED_AGAIN = "#exit_on_failure=false;retry_period_init_ms=500;retry_period_max_ms=2000"

# Of a router that joins another: whichever is there first waits for the other, again and again.
_PATIENT: dict[str, object] = {
    "connect/timeout_ms": -1,
    "connect/exit_on_failure": False,
    "connect/retry": {"period_init_ms": 100, "period_max_ms": 100, "period_increase_factor": 1.0},
}


class Public(NamedTuple):
    """A listener for other machines: where (tls/...), as whom, for which rigs, who is admitted."""

    endpoint: str
    identity: Identity
    rigs: tuple[str, ...]
    roles: tuple[str, ...]


def _config(settings: dict[str, object]) -> zenoh.Config:
    import zenoh

    quiet: dict[str, object] = {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # a router would wait half a second for what scouting finds
        "transport/shared_memory/enabled": False,
        "adminspace/enabled": False,
    }
    config = zenoh.Config()
    for key, value in {**quiet, **settings}.items():
        config.insert_json5(key, json.dumps(value))  # pyright: ignore[reportUnknownMemberType]
    return config


def client_config(endpoint: str, identity: Identity | None = None) -> zenoh.Config:
    """A client of the router at `endpoint`, e.g. tcp/127.0.0.1:7447; with `identity`, one that shows its certificate.

    Opening it fails after half a second without a router, over TLS after one second;
    once open, it returns to a router that went away, for ever."""
    # Over TLS a try that is refused costs others: fewer of them.
    timeout_ms, retry_ms = (1000, 500) if is_tls(endpoint) else (500, round(1e3 * RETRY_S))
    return _config(
        {
            "mode": "client",
            "connect/endpoints": [endpoint],
            "listen/endpoints": [],
            "connect/timeout_ms": timeout_ms,
            "connect/exit_on_failure": True,
            "connect/retry": {
                "period_init_ms": retry_ms,
                "period_max_ms": retry_ms,
                "period_increase_factor": 1.0,
            },
            **({} if identity is None else as_client(identity)),
        }
    )


def open_client(
    endpoint: str,
    keep_trying: Callable[[], bool],
    identity: Identity | None = None,
    report: Callable[[str], None] = _log.warning,
) -> zenoh.Session | None:
    """Open a client session, waiting for the router while `keep_trying()`; None when it said no.

    Any ordinary thread; blocks a second at a time (over TLS up to three), so that a stop signal is heard. (With
    zenoh's own endless timeout `open` would not return to Python.) `report` is called, once, with the reason why a
    TLS router refuses us. Close the session before the process ends, or the exit hangs.
    """
    import zenoh

    reported = None
    while keep_trying():
        try:
            return zenoh.open(client_config(endpoint, identity))
        except zenoh.ZError:
            if identity is None or not is_tls(endpoint):
                continue
        from protocol.access.handshake import why_refused

        why = why_refused(endpoint, identity)
        if why is not None and why.words != reported:
            report(why.words)
            reported = why.words
        if why is not None and why.somebody_is_there:
            _wait(_REFUSED_AGAIN_S, keep_trying)
    return None


def _wait(seconds: float, keep_trying: Callable[[], bool]) -> None:
    end = time.monotonic() + seconds
    while time.monotonic() < end and keep_trying():
        time.sleep(_TURN_S)


def router_config(listen: str, upstream: Sequence[str] = ()) -> zenoh.Config:
    """A router at `listen`: a loopback address over TCP, because whoever comes in there may do everything.

    It joins the routers at `upstream`, each of which may come later, and go and return."""
    chained: dict[str, object] = {"connect/endpoints": list(upstream), **_PATIENT} if upstream else {}
    own = {"mode": "router", "listen/endpoints": [listen], "listen/exit_on_failure": True}
    return _config({**own, **chained})


def open_router(listen: str, upstream: Sequence[str] = ()) -> zenoh.Session:
    """Open a router, as `router_config` has it; OSError, worded, when `listen` is taken or no address at all."""
    import zenoh

    try:
        return zenoh.open(router_config(listen, upstream))
    except zenoh.ZError as error:
        raise OSError(
            f"Zenoh cannot listen at {listen} (taken by another rig?): {str(error)[:160]}"
        ) from None


def open_access(router: str, public: Public) -> zenoh.Session:
    """Open a second router, for other machines, that passes on to the one at `router` what the access rules permit.

    Either side may come later, and go and return: a network that is not there yet stops no local play.
    """
    import zenoh

    return zenoh.open(
        _config(
            {
                "mode": "router",
                **as_listener(public.identity),
                "listen/endpoints": [public.endpoint + _TRIED_AGAIN],
                "listen/timeout_ms": -1,
                "connect/endpoints": [router],
                **_PATIENT,
                "access_control": access_control(public.rigs, public.roles),
                "transport/link/rx/max_message_size": MAX_MESSAGE_BYTES,
                "transport/link/tls/so_rcvbuf": UNREAD_BYTES,
                "transport/link/tx/batch_size": UNREAD_BYTES,
                "transport/link/tx/queue/congestion_control/block/wait_before_close": SLOW_READER_US,
            }
        )
    )
