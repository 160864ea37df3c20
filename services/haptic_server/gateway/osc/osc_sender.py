"""Sending: packets of one event, encoded once, to every target once."""

import socket
from collections.abc import Iterable, Sequence

from haptic_server.gateway.osc.refusal_counts import RefusalCounts
from haptic_server.gateway.osc.targets import Endpoint


class OscSender:
    """Sends through a non-blocking UDP socket that belongs to the OSC server.

    Any thread; never blocks, never raises: what a full buffer or an absent listener keeps from being sent is counted as
    `send_full` and `send_failed`.
    """

    def __init__(self, udp: socket.socket, refusals: RefusalCounts) -> None:
        self._udp = udp
        self._refusals = refusals

    def send(self, packets: Sequence[bytes], endpoints: Iterable[Endpoint]) -> None:
        """Send all packets, in order, to each endpoint; an endpoint named twice gets them once."""
        for endpoint in dict.fromkeys(endpoints):
            for packet in packets:
                try:
                    self._udp.sendto(packet, endpoint)
                except BlockingIOError:
                    self._refusals.count("send_full")
                except OSError:
                    self._refusals.count("send_failed")
