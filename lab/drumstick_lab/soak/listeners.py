"""Listeners to a rig that soaks: one by OSC, one by Zenoh. Each counts what came, is missing, or came twice."""

import socket
import threading
from dataclasses import asdict, dataclass

from protocol.keys import Keys
from protocol.messages import Release, Strike, decode
from protocol.session import open_client
from realtime.stop import StopRequest

OSC_NUMBERS = 2**31  # OSC's strikes are numbered within 31 bits
_RECEIVE_BYTES = 1 << 22
_POLL_S = 0.2


@dataclass
class Sequence:
    """Strikes by number; another `boot` begins anew."""

    heard: int = 0
    missing: int = 0
    again: int = 0
    boots: int = 0
    other: int = 0  # messages of another kind
    unreadable: int = 0
    _boot: int | None = None
    _newest: int = 0

    def note(self, boot: int, seq: int, numbers: int = 0) -> None:
        """A strike came. `numbers`: after how many they begin again, 0: never."""
        self.heard += 1
        if boot != self._boot:
            self._boot, self._newest = boot, seq
            self.boots += 1
            return
        ahead = seq - self._newest
        if numbers:
            ahead = (ahead + numbers // 2) % numbers - numbers // 2
        if ahead <= 0:
            self.again += 1
            return
        self.missing += ahead - 1
        self._newest = seq

    def counts(self) -> dict[str, int]:
        """Counts to report."""
        return {name: value for name, value in asdict(self).items() if not name.startswith("_")}


def count_osc(port: int, stop: StopRequest) -> dict[str, int]:
    """Listen at 127.0.0.1:`port` as a program with python-osc does, until `stop`."""
    from pythonosc.osc_message import OscMessage, ParseError

    heard = Sequence()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BYTES)
        udp.bind(("127.0.0.1", port))
        udp.settimeout(_POLL_S)
        while not stop.is_set():
            try:
                message = OscMessage(udp.recv(65536))
            except TimeoutError:
                continue
            except ParseError:
                heard.unreadable += 1
                continue
            if message.address.endswith("/strike"):
                heard.note(0, int(message.params[0]), OSC_NUMBERS)
            else:
                heard.other += 1
    return heard.counts()


def count_zenoh(endpoint: str, rig: str, stop: StopRequest) -> dict[str, int]:
    """Listen to strikes and releases, and to everything else that the rig publishes, until `stop`."""
    import zenoh

    heard, lock, keys = Sequence(), threading.Lock(), Keys(rig)
    session = open_client(endpoint, lambda: not stop.is_set())
    if session is None:
        return heard.counts()

    def take(sample: zenoh.Sample) -> None:
        with lock:
            try:
                if str(sample.key_expr) == keys.strike:
                    strike = decode(sample.payload.to_bytes(), Strike)
                    heard.note(strike.boot, strike.seq)
                    return
                if str(sample.key_expr) == keys.release:
                    decode(sample.payload.to_bytes(), Release)
                heard.other += 1
            except ValueError:
                heard.unreadable += 1

    subscribers = [session.declare_subscriber(key, take) for key in (keys.strike, keys.release, keys.state)]
    while not stop.wait(_POLL_S):
        pass
    for subscriber in subscribers:
        subscriber.undeclare()
    session.close()
    return heard.counts()
