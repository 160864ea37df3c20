"""VALUE of each address: the servo's readback of a parameter, the newest message of anything else.

Belongs to the OSCQuery thread. The lock of the parameters is taken for the microseconds that its readback takes.
"""

import math

from haptic_server.gateway.osc.prescan import Message, Unreadable, prescan
from haptic_server.gateway.oscquery.tree import Node
from haptic_server.gateway.settings import Parameters
from protocol.osc import Argument


class Values:
    """Values of one rig."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._newest: dict[str, list[Argument]] = {}

    def note(self, datagram: bytes) -> str:
        """Keep the arguments of a message that the rig sent; its address, "" if it is no message."""
        message: Message | Unreadable = prescan(datagram)
        if isinstance(message, Unreadable):
            return ""
        self._newest[message.address] = list(message.args)
        return message.address

    def snapshot(self) -> "Snapshot":
        """Snapshot of the present values: one readback for a whole tree."""
        return Snapshot(self._parameters, self._newest)


class Snapshot:
    """The values at one moment; all parameters are read at most once."""

    def __init__(self, parameters: Parameters, newest: dict[str, list[Argument]]) -> None:
        self._parameters = parameters
        self._newest = newest
        self._read: dict[str, float] | None = None

    def of(self, node: Node) -> list[Argument] | None:
        """The arguments of the node's message; None while there is none, or no number."""
        if not node.parameter:
            return self._newest.get(node.path)
        if self._read is None:
            self._read = self._parameters.values()
        value = self._read[node.parameter]
        if not math.isfinite(value):
            return None
        if node.norm:
            value = min(max(self._parameters.table[node.parameter].norm(value), 0.0), 1.0)
        return [value]
