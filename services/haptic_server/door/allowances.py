"""Limits on what one session at the public listener may declare and ask for; one that goes beyond is ended.

Each token or subscription of a stranger is carried to the gateway's own router, where thousands of them hold up
strikes, most of all when they end at once. Zenoh limits none of it (its access rules know keys, no numbers), so what
its log tells is counted here.
"""

from __future__ import annotations

import ipaddress
import os
import queue
import socket
import stat
import threading
from typing import TYPE_CHECKING

from protocol.endpoint import host_and_port

if TYPE_CHECKING:
    import zenoh

# Different keys of each kind that one session may name in its life. A page names some twenty, a program that follows
# the play fewer; a venue's router speaks for all behind it. Thousands that came and went made strikes 0.26 s late.
MOST: dict[str, tuple[int, str]] = {
    "Liveliness Token": (256, "liveliness tokens"),
    "Declare Subscriber": (256, "subscriptions"),
    "Declare Liveliness Subscriber": (256, "subscriptions to tokens"),
    "Liveliness Query": (1024, "keys of tokens asked for"),
    "Query": (1024, "keys asked for"),
}
_MOST_SESSIONS = 2000


class Allowances:
    """Counts of every session that is in. One thread: the one that reads Zenoh's log."""

    def __init__(self) -> None:
        self._named: dict[
            str, dict[str, set[int]]
        ] = {}  # session -> kind -> hashes of keys: a key may be long

    def spend(self, who: str, kind: str, key: str) -> str:
        """Note what a session did. Empty while it keeps within its limits, else which one it went beyond, in words."""
        if kind not in MOST:
            return ""
        if who not in self._named and len(self._named) >= _MOST_SESSIONS:
            del self._named[next(iter(self._named))]
        most, words = MOST[kind]
        keys = self._named.setdefault(who, {}).setdefault(kind, set())
        keys.add(hash(key))
        if len(keys) <= most:
            return ""
        del self._named[who]
        return f"more than {most} {words}"


class Cutter:
    """Ends links, on a thread of its own: whoever reads Zenoh's log must not wait for Zenoh, which waits for him."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._due: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._run, name="cutter", daemon=True).start()

    def cut(self, who: str) -> None:
        """End the links of this session, soon. Any thread; never waits."""
        self._due.put(who)

    def _run(self) -> None:
        while True:
            who = self._due.get()
            for link in self._session.info.links():
                if str(link.zid) == who:
                    shut_down(*host_and_port(str(link.dst)))


def shut_down(host: str, port: int) -> bool:
    """Shut this process's connection to a peer; whether there was one. Zenoh has no call that closes a link."""
    peer = _plain(host), port
    shut = [_is_shut(int(name), peer) for name in os.listdir("/proc/self/fd")]  # each of its links
    return any(shut)


def _is_shut(number: int, peer: tuple[str, int]) -> bool:
    try:
        if not stat.S_ISSOCK(os.fstat(number).st_mode):
            return False
        with socket.socket(fileno=os.dup(number)) as ours:
            if ours.family not in (socket.AF_INET, socket.AF_INET6):
                return False
            found = ours.getpeername()
            if (_plain(found[0]), found[1]) != peer:
                return False
            ours.shutdown(socket.SHUT_RDWR)
    except OSError:  # closed meanwhile, or one that is not connected
        return False
    return True


def _plain(host: str) -> str:
    # A listener on every address sees an IPv4 peer as an IPv6 one.
    address = ipaddress.ip_address(host.partition("%")[0])
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped or address)
