"""Check for free ports before anything starts, so that a taken one gives a clear line and exit status 3."""

import errno
import socket
from collections.abc import Collection

from rig.exit_status import unavailable

_BESIDE = 50  # ports above a taken one that are tried


def _bound(kind: socket.SocketKind, host: str, port: int) -> int:
    # The port that could be bound; 0 lets the system choose. Raises OSError.
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, kind) as probe:
        if kind == socket.SOCK_STREAM:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        probe.bind((host, port))
        return int(probe.getsockname()[1])


def _require_free(kind: socket.SocketKind, host: str, port: int, what: str, option: str) -> None:
    try:
        _bound(kind, host, port)
    except OSError as error:
        unavailable(
            f"{what} {host}:{port}: {error.strerror}; choose another with {option}, or let drumstick up choose free"
            " ones with --port auto"
        )


def free_port(kind: socket.SocketKind, host: str, port: int, promised: Collection[int] = ()) -> int:
    """`port` where it can be bound now, else the next one above it, else one of the system's choice; none
    that is `promised` to somebody else.

    Raises OSError where the host itself cannot be bound.
    """
    for at in (*range(port, min(port + _BESIDE, 65536)), 0):
        if at in promised:
            continue
        try:
            return _bound(kind, host, at)
        except OSError as error:
            if error.errno not in (errno.EADDRINUSE, errno.EACCES):
                raise
    raise OSError(errno.EADDRINUSE, "no port is free")


def require_free_tcp(host: str, port: int, what: str, option: str) -> None:
    """Stop with status 3 unless `host:port` can be bound."""
    _require_free(socket.SOCK_STREAM, host, port, what, option)


def require_free_udp(host: str, port: int, what: str, option: str) -> None:
    """Stop with status 3 unless `host:port` can be bound."""
    _require_free(socket.SOCK_DGRAM, host, port, what, option)


def listens(host: str, port: int) -> bool:
    """True when something accepts TCP connections there now."""
    try:
        socket.create_connection((host, port), timeout=0.2).close()
    except OSError:  # nobody there, or a name that cannot be resolved now
        return False
    return True
