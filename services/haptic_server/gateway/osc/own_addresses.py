"""The OSC server's own socket addresses: it must neither send there nor hear itself."""

import socket
from ipaddress import ip_address

from haptic_server.gateway.osc.targets import Endpoint

_EVERYWHERE = "0.0.0.0"


class OwnAddress:
    """Addresses of the socket bound at `bound`. Any thread; does not block."""

    def __init__(self, bound: Endpoint) -> None:
        self._host, self._port = bound

    def holds(self, endpoint: Endpoint) -> bool:
        """True when a datagram to this endpoint would reach this socket, or one from there came from it."""
        host, port = endpoint
        if port != self._port:
            return False
        # To 0.0.0.0 is to this machine. A server that listens everywhere has whatever addresses the machine has now.
        return host in (self._host, _EVERYWHERE) or (self._host == _EVERYWHERE and _is_this_machines(host))


def _is_this_machines(host: str) -> bool:
    address = ip_address(host)
    if address.is_loopback:
        return True
    if address.is_multicast or host == "255.255.255.255":
        return False
    # Only an address of this machine can be bound; asked each time, because cables and leases come and go.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((host, 0))
        except OSError:
            return False
    return True
