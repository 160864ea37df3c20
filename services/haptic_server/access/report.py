"""The public listener as `doctor` tells it: who is in by which role, and what Zenoh turned away."""

from __future__ import annotations

import errno
import socket
from collections import Counter
from typing import TYPE_CHECKING

from haptic_server.access.disconnection import Disconnector
from haptic_server.access.refusals import Refusals
from protocol.endpoint import host_and_port, is_tls
from protocol.foreign_text import shown
from protocol.session import Public

if TYPE_CHECKING:
    import zenoh


def listener_report(
    session: zenoh.Session, public: Public, refusals: Refusals, disconnector: Disconnector
) -> dict[str, object]:
    """JSON-ready. Any thread; a system call or two."""
    present = Counter(
        shown(link.auth_identifier or "?") for link in session.info.links() if is_tls(str(link.src))
    )
    return {
        "endpoint": public.endpoint,
        "is_open": _is_taken(public.endpoint),
        "roles": list(public.roles),
        "present": dict(present),
        **refusals.counters(),
        "turned_back": dict(disconnector.turned_back),
    }


def _is_taken(endpoint: str) -> bool:
    # Zenoh does not tell whether a listener that it tries again and again is there by now.
    host, port = host_and_port(endpoint)
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            return error.errno == errno.EADDRINUSE
    return False
