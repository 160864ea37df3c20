"""OSC with a whole rig, through python-osc, from a port that the rig sends to."""

import queue
import socket
import threading
import time

import pytest
from pythonosc.osc_message import OscMessage
from rig_process import PATIENCE_S

from osc_bench import built


class OscPort:
    """A UDP port whose messages are taken as they come, by a thread, and kept.

    A roll is 160 messages a second, and a socket of Linux keeps 256 of them: were they left there while a test does
    something else, an answer would find no room after 2 s, and be lost.
    """

    def __init__(self, listens_at: int = 0, sends_to: int = 0) -> None:
        """`listens_at`: any free port if not given; `sends_to`: where the rig listens, for `send`."""
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", listens_at))
        self._udp.settimeout(0.1)
        self.port: int = self._udp.getsockname()[1]
        self._sends_to = sends_to
        self._came: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._ended = threading.Event()
        self._taking = threading.Thread(target=self._take)
        self._taking.start()

    def __enter__(self) -> "OscPort":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self._ended.set()
        self._taking.join()
        self._udp.close()

    def _take(self) -> None:
        while not self._ended.is_set():
            try:
                self._came.put(self._udp.recv(65536))
            except TimeoutError:
                continue

    def send(self, address: str, *args: int | float | str) -> None:
        self._udp.sendto(built(address, *args), ("127.0.0.1", self._sends_to))

    def count(self, address: str) -> int:
        """Count of messages at `address` that came since the last call; all others are dropped."""
        found = 0
        while not self._came.empty():
            found += OscMessage(self._came.get()).address == address
        return found

    def next(self, *addresses: str, value: float | str | None = None) -> tuple[str, list[object]]:
        """The next message at one of these addresses, whose first argument is (about) `value` if it is given."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            try:
                message = OscMessage(self._came.get(timeout=max(end - time.monotonic(), 0.0)))
            except queue.Empty:
                break
            if message.address in addresses and (value is None or message.params[0] == pytest.approx(value)):
                return message.address, list(message.params)
        raise AssertionError(f"no {' or '.join(addresses)} {'' if value is None else value} came")

    def receive(self, address: str, value: float | str | None = None) -> list[object]:
        """Arguments of the next message at `address`, or of the next one whose first argument is `value`."""
        return self.next(address, value=value)[1]
