"""This process's own sockets, found by address: Zenoh has no call that closes a link or sets an option of a socket."""

import ipaddress
import os
import socket
import stat
from collections.abc import Generator
from contextlib import contextmanager

# A connection that says nothing is the kernel's, not Zenoh's, for so long: a good one speaks first, and at once.
SILENT_S = 10


def shut_down(host: str, port: int) -> bool:
    """Shut this process's connections to a peer; whether there was one."""
    peer = plain(host), port
    shut = [_is_shut(number, peer) for number in _numbers()]  # each of its links
    return any(shut)


def hold_silent(port: int) -> bool:
    """Let our listener at this port accept only connections that have sent something; whether there is one."""
    held = [_is_deferred(number, port) for number in _numbers()]  # one for each family of addresses
    return any(held)


def plain(host: str) -> str:
    """An address as text; a listener on every address sees an IPv4 peer as an IPv6 one."""
    address = ipaddress.ip_address(host.partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped or address)


def _numbers() -> list[int]:
    return [int(name) for name in os.listdir("/proc/self/fd")]


@contextmanager
def _internet_socket(number: int) -> Generator[socket.socket | None, None, None]:
    if not stat.S_ISSOCK(os.fstat(number).st_mode):
        yield None
        return
    with socket.socket(fileno=os.dup(number)) as ours:
        is_tcp = ours.family in (socket.AF_INET, socket.AF_INET6) and ours.type == socket.SOCK_STREAM
        yield ours if is_tcp else None


def _is_shut(number: int, peer: tuple[str, int]) -> bool:
    try:
        with _internet_socket(number) as ours:
            if ours is None:
                return False
            found = ours.getpeername()
            if (plain(found[0]), found[1]) != peer:
                return False
            ours.shutdown(socket.SHUT_RDWR)
    except OSError:  # closed meanwhile, or one that is not connected
        return False
    return True


def _is_deferred(number: int, port: int) -> bool:
    try:
        with _internet_socket(number) as ours:
            if ours is None or ours.getsockname()[1] != port:
                return False
            if not ours.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN):
                return False
            ours.setsockopt(socket.IPPROTO_TCP, socket.TCP_DEFER_ACCEPT, SILENT_S)
    except OSError:  # closed meanwhile
        return False
    return True
