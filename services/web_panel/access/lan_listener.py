"""The socket that other machines reach (--panel-lan): TLS, and so many connections and no more.

A connection counts from the moment it is taken, before its handshake: whoever opens many and says nothing leaves the
page of this machine its files and sockets. The eight addresses from which somebody came in last have places of their
own: strangers who take all others keep no phone from PANIC that has lost its connection. That holds at the same address
and until the panel starts anew; after that, and at another address, the phone is a stranger.
"""

import errno
import hashlib
import socket
import ssl
import sys
from pathlib import Path
from typing import NamedTuple

from web_panel.access.lan_admission import LIFE_H, LanAdmission

HANDSHAKE_S = 5.0
OF_ONE = 16  # of one address: a browser has one for the page, one for each pad, and some that end
STRANGERS, KNOWN = 64, 8  # connections; addresses, the newest
IN_ALL = (
    STRANGERS + KNOWN * OF_ONE
)  # also of those who were known once; leaves the page its part of the rig's files
# In one call; asyncio takes up to 100 connections in a turn of its loop, and ends at BlockingIOError.
_REFUSALS = 16
_IP_FREEBIND = 15  # linux/in.h; Python has no name for it


class LimitedListener(socket.socket):
    """A listening socket that closes at once what is beyond its limits. Used by one loop."""

    def __init__(self, host: str, port: int) -> None:
        """Raises OSError when the port is taken."""
        super().__init__(socket.AF_INET, socket.SOCK_STREAM)
        self._open: list[tuple[socket.socket, str]] = []
        self._known: dict[str, None] = {}  # the newest last
        try:
            self.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            if sys.platform == "linux":
                # A panel that starts anew while its network is away is reached when that returns.
                self.setsockopt(socket.IPPROTO_IP, _IP_FREEBIND, 1)
            self.bind((host, port))
            self.listen()
        except OSError:
            self.close()
            raise

    def accept(self) -> tuple[socket.socket, tuple[str, int]]:
        """The next connection within the limits.

        Raises BlockingIOError when there is none, and after 16 that are closed: a flood leaves the loop its other work.
        """
        for _ in range(_REFUSALS):
            connection, address = super().accept()
            self._open = [(each, host) for each, host in self._open if each.fileno() >= 0]
            of_one = sum(host == address[0] for _, host in self._open)
            strangers = sum(host not in self._known for _, host in self._open)
            has_place = address[0] in self._known or strangers < STRANGERS
            if has_place and of_one < OF_ONE and len(self._open) < IN_ALL:
                self._open.append((connection, address[0]))
                return connection, address
            connection.close()
        raise BlockingIOError(errno.EAGAIN, "too many connections beyond the limits")

    def keep_places_for(self, host: str) -> None:
        """Somebody at this address has come in."""
        self._known.pop(host, None)
        self._known[host] = None
        if len(self._known) > KNOWN:
            del self._known[next(iter(self._known))]


class Lan(NamedTuple):
    """Admission, socket and certificate of the page on the network."""

    admission: LanAdmission
    listener: LimitedListener
    tls: ssl.SSLContext
    fingerprint: str

    @property
    def words(self) -> str:
        """Words about what is open, and for whom."""
        return (
            f"The page is open to the network at {self.admission.address} (--panel-lan). A browser that logs in by a"
            f" link may do all that this page does, for {LIFE_H} hours; no other gets in. The browser warns that it"
            f" does not know the certificate. Its SHA-256 fingerprint must be {self.fingerprint}; if it is another,"
            " someone intercepts the connection: do not continue."
        )


def tls_of(certificate: Path, private_key: Path) -> ssl.SSLContext:
    """TLS 1.2 or newer with this certificate. Raises OSError (ssl.SSLError is one)."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, private_key)
    return context


def fingerprint_of(certificate: str) -> str:
    """SHA-256 of a certificate in PEM form, as browsers show it: pairs of hexadecimal digits."""
    digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(certificate)).hexdigest().upper()
    return ":".join(digest[i : i + 2] for i in range(0, len(digest), 2))
