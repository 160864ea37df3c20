"""Access rules of OSCQuery: reading, listening, writing. Pure: addresses and headers in, a verdict out. Any thread.

The source must be allowed as for OSC. The Host must be this machine's own name or address (a foreign name that resolves
to it is DNS rebinding). The Origin, when a browser sends one, must be this server's own: no page is served here, so the
page of a stranger can neither read nor listen.
"""

import re
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from http import HTTPStatus
from ipaddress import IPv4Address, IPv4Network, IPv6Network, ip_address
from typing import NamedTuple, Protocol

from protocol.endpoint import is_loopback

_HOST = re.compile(r"([A-Za-z0-9.-]{1,253}|\[::1\])(?::[0-9]{1,5})?")
_LOOPBACK = ("127.0.0.1", "localhost", "[::1]")


class Headers(Protocol):
    """The part of a request's headers used here."""

    def get_all(self, key: str, /) -> list[str]:
        """Every value sent under this name, in any case of letters."""
        ...


class Verdict(NamedTuple):
    """OK, or why not."""

    status: HTTPStatus
    words: str = ""


_WELCOME = Verdict(HTTPStatus.OK)


@dataclass(frozen=True)
class Admission:
    """The rules of one server that is bound to the numeric address `bound`."""

    bound: str
    allow: Sequence[IPv4Network | IPv6Network]

    def admits(self, source: str) -> bool:
        """True when this numeric address may connect at all."""
        return any(ip_address(source) in network for network in self.allow)

    def judge(self, headers: Headers) -> Verdict:
        """The verdict on one request."""
        hosts = headers.get_all("Host")
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return Verdict(HTTPStatus.MISDIRECTED_REQUEST, "Ask by this machine's own name or address.")
        if any(origin.lower() != f"http://{hosts[0].lower()}" for origin in headers.get_all("Origin")):
            return Verdict(HTTPStatus.FORBIDDEN, "Another site's page may not use this server.")
        return _WELCOME

    def _is_own(self, host: str) -> bool:
        matched = _HOST.fullmatch(host)
        if matched is None:
            return False
        name = matched[1].lower()
        if name in _LOOPBACK:
            return True
        if is_loopback(self.bound):
            return False
        machine = socket.gethostname().lower()
        # An address cannot be rebound, a name can: of names only those that this machine has itself.
        return _is_address(name) or name in (machine, f"{machine.partition('.')[0]}.local")


def _is_address(name: str) -> bool:
    try:
        IPv4Address(name)
    except ValueError:
        return False
    return True
