"""OSC of a replay: strikes, releases, their mirrors and readbacks, as the live rig sends them. The playing thread only.

Nothing is heard. A socket whose targets are all on this machine is bound to loopback.
"""

import socket
from collections.abc import Mapping, Sequence

from drumstick.scenes.table import Parameter
from protocol import osc
from protocol.messages import Message, Readback, Release, Strike, number_of

_LOOPBACK = "127."


def _numeric(target: str) -> tuple[str, int]:
    host, _, port = target.rpartition(":")
    found = socket.getaddrinfo(host, int(port), socket.AF_INET, socket.SOCK_DGRAM)
    return str(found[0][4][0]), int(found[0][4][1])


class OscOut:
    """Sends to `targets`, host:port; `table`: the scene's parameters, for their 0..1 form. Never blocks.

    `unsent` counts what a full buffer or an absent listener kept from going out, `unsendable` numbers that OSC has not.
    """

    def __init__(self, targets: Sequence[str], prefix: str, table: Mapping[str, Parameter]) -> None:
        self._prefix = prefix
        self._table = table
        self._targets = list(dict.fromkeys(_numeric(target) for target in targets))
        self._inside = False
        self.unsent = self.unsendable = 0
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.setblocking(False)
        if all(host.startswith(_LOOPBACK) for host, _ in self._targets):
            self._udp.bind(("127.0.0.1", 0))

    def send(self, name: str, message: Message) -> None:
        """Send what the live rig would send for this message; nothing for most kinds."""
        try:
            packets = self._packets(name, message)
        except ValueError:
            self.unsendable += 1
            return
        self._send(packets)

    def _packets(self, name: str, message: Message) -> list[bytes]:
        p = self._prefix
        match message:
            case Strike(x=x, y=y, level=level):
                seq = number_of(message)
                packet = osc.strike(p, seq, x, y, message.z_speed_m_per_s, level, message.peak_estimate_N)
                self._inside = True
                return [packet, osc.level(p, level), osc.x(p, x), osc.y(p, y), osc.gate(p, True)]
            case Release():
                seq = number_of(message)
                exit_speed, contact_s = message.exit_speed_m_per_s, message.contact_s
                packet = osc.release(p, seq, exit_speed, message.impulse_N_s, message.peak_N, contact_s)
                self._inside = False
                return [packet, osc.gate(p, False)]
            case Readback(value=value, pending=False):
                row = self._table.get(name)
                norm = [] if row is None else [osc.param_norm(p, name, row.norm(value))]
                return [osc.param(p, name, value), *norm]
            case _:
                return []

    def alive(self, rig: str, status: str, strikes: int) -> None:
        """/alive; once a second."""
        self._send([osc.alive(self._prefix, rig, status, strikes)])

    def close(self) -> None:
        """The gate is shut, whatever was being played."""
        if self._inside:
            self._send([osc.gate(self._prefix, False)])
        self._udp.close()

    def _send(self, packets: Sequence[bytes]) -> None:
        for target in self._targets:
            for packet in packets:
                try:
                    self._udp.sendto(packet, target)
                except OSError:
                    self.unsent += 1
