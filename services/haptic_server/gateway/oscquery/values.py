"""VALUE of each address: the servo's readback of a parameter, the newest message of anything else.

Belongs to the OSCQuery thread. The desk's lock is taken for the microseconds that its readback takes.
"""

import math

from haptic_server.gateway.desk import Desk
from haptic_server.gateway.osc.prescan import Message, Unreadable, prescan
from haptic_server.gateway.oscquery.tree import Node
from protocol.osc import Argument


class Values:
    """Of one rig."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._newest: dict[str, list[Argument]] = {}

    def note(self, datagram: bytes) -> str:
        """Keep the arguments of a message that the rig sent; its address, "" if it is no message."""
        message: Message | Unreadable = prescan(datagram)
        if isinstance(message, Unreadable):
            return ""
        self._newest[message.address] = list(message.args)
        return message.address

    def look(self) -> "Look":
        """What holds now: one readback for a whole tree."""
        return Look(self._desk, self._newest)


class Look:
    """The values at one moment; the desk is asked at most once."""

    def __init__(self, desk: Desk, newest: dict[str, list[Argument]]) -> None:
        self._desk = desk
        self._newest = newest
        self._parameters: dict[str, float] | None = None

    def of(self, node: Node) -> list[Argument] | None:
        """The arguments of the node's message; None while there is none, or no number."""
        if not node.parameter:
            return self._newest.get(node.path)
        if self._parameters is None:
            self._parameters = self._desk.values()
        value = self._parameters[node.parameter]
        if not math.isfinite(value):
            return None
        if node.norm:
            value = min(max(self._desk.table[node.parameter].norm(value), 0.0), 1.0)
        return [value]
