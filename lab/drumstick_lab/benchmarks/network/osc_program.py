"""An OSC program beside a rig, as a DAW is one: asks, and notes each strike and when it came."""

import socket
import threading
import time
from typing import NamedTuple

from pythonosc.osc_message import OscMessage
from rig_process import Rig

from osc_bench import built


class Heard(NamedTuple):
    """One `/drumstick/strike`: when it came, monotonic s; its number, negative of one that was played; its level."""

    came_s: float
    seq: int
    level: float


class OscProgram:
    """Listens at the port that the rig sends to, by a thread of its own, until closed."""

    def __init__(self, rig: Rig) -> None:
        self.strikes: list[Heard] = []
        self._to = ("127.0.0.1", rig.osc_in)
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", rig.osc_out))
        self._udp.settimeout(0.1)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._hear)
        self._thread.start()

    def _hear(self) -> None:
        while not self._over.is_set():
            try:
                datagram = self._udp.recv(65536)
            except TimeoutError:
                continue
            message = OscMessage(datagram)
            if message.address == "/drumstick/strike":
                seq, _, _, _, level, *_ = message.params
                self.strikes.append(Heard(time.monotonic(), int(seq), float(level)))

    def load(self, scene: str) -> None:
        """Ask for a scene."""
        self._udp.sendto(built("/drumstick/scene/load", scene), self._to)

    def close(self) -> None:
        """Hear no more."""
        self._over.set()
        self._thread.join()
        self._udp.close()
