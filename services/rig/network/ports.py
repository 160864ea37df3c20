"""Check for free ports before anything starts, so that a taken one gives a clear line and exit status 3."""

import socket

from rig.exit_status import unavailable


def _require_free(kind: socket.SocketKind, host: str, port: int, what: str, option: str) -> None:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, kind) as probe:
        if kind == socket.SOCK_STREAM:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            unavailable(f"{what} {host}:{port}: {error.strerror}; choose another with {option}")


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
