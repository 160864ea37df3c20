"""Sockets inside this machine that join OSCQuery to the OSC server, which knows them as a target and as senders.

What the rig sends reaches OSCQuery as it reaches a DAW, and what a WebSocket client writes is heard as UDP is: same
scan, same allowances, same answers. Neither side waits for the other: a full socket buffer drops.
"""

import socket
import struct
import sys

from haptic_server.gateway.osc.prescan import MAX_BYTES
from haptic_server.gateway.osc.targets import Endpoint

_SO_RXQ_OVFL = (
    40  # Linux: how many datagrams the full buffer has dropped comes along with each one that it did not
)
_ROOM_BYTES = 1 << 20
_AT_ONCE = 256


def _inner_host(front: str) -> str:
    # The front may hear at one address only; where it hears at all of them, loopback is one.
    numeric = socket.gethostbyname(front)
    return "127.0.0.1" if numeric == "0.0.0.0" else numeric


class OscBridge:
    """One UDP socket, bound where the front can reach it. One thread at a time; never blocks.

    The constructor raises OSError. Give `endpoint` to the front as a target, then `join` the front; it is one of
    `insiders`, whom the front hears, until it is closed.
    """

    def __init__(self, front_host: str, insiders: set[Endpoint] | None = None) -> None:
        self._insiders: set[Endpoint] = set() if insiders is None else insiders
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._udp.setblocking(False)
            self._udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _ROOM_BYTES)
            if sys.platform == "linux":
                self._udp.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
            self._host = _inner_host(front_host)
            self._udp.bind((self._host, 0))
        except BaseException:
            self._udp.close()
            raise
        self.dropped = 0
        self._own = self.endpoint
        self._insiders.add(self._own)

    @property
    def endpoint(self) -> Endpoint:
        """Endpoint that reaches this socket."""
        host, port = self._udp.getsockname()
        return str(host), int(port)

    def fileno(self) -> int:
        """File descriptor, for select."""
        return self._udp.fileno()

    def join(self, front_port: int) -> None:
        """Receive from the OSC server at this port only, from now on."""
        self._udp.connect((self._host, front_port))

    def send(self, datagram: bytes) -> bool:
        """Send to the OSC server; False when it could not be sent."""
        try:
            self._udp.send(datagram)
        except OSError:
            return False
        return True

    def take(self) -> list[bytes]:
        """Datagrams that arrived since the last call, at most 256."""
        taken: list[bytes] = []
        while len(taken) < _AT_ONCE:
            try:
                datagram, ancillary, _, _ = self._udp.recvmsg(MAX_BYTES + 1, 64)
            except OSError:  # nothing there, or an ICMP refusal of something sent earlier
                break
            for level, kind, counted in ancillary:
                if (level, kind) == (socket.SOL_SOCKET, _SO_RXQ_OVFL):
                    self.dropped = int(struct.unpack("=I", counted[:4])[0])
            taken.append(datagram)
        return taken

    def close(self) -> None:
        """Idempotent."""
        self._insiders.discard(self._own)
        self._udp.close()
