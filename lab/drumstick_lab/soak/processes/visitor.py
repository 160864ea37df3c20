"""Visitor of a soaking rig: asks and sets, by Zenoh and OSC, uses presets, looks at the page.

Every visit opens everything anew and closes it again: what a rig keeps of those who left would show as growth.
"""

import socket
import sys
import time
import urllib.request
from collections import Counter
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import msgspec

from protocol import osc
from protocol.keys import Keys
from protocol.messages import LeaseRequest, encode
from protocol.session import open_client
from realtime.stop import StopRequest

_PATIENCE_S = 5.0
_LOOKS_S = 0.5  # at the page
_PRESET_EVERY = 5  # visits
_CHANGE = 0.01  # by which share a parameter goes up and down again
_NAME = "soak"


class Where(NamedTuple):
    """The rig to visit."""

    rig: str
    endpoint: str
    osc_port: int
    panel_port: int
    token_file: Path


class Visitor:
    """`parameter` is set to its own value and a hundredth more, in turns."""

    def __init__(self, where: Where, parameter: str) -> None:
        self._where = where
        self._keys = Keys(where.rig)
        self._parameter = parameter
        self._value: float | None = None
        self.counts: Counter[str] = Counter()

    def run(self, stop: StopRequest, pause_s: float, hurry_s: float) -> dict[str, int | str]:
        """Visit until `stop`; for `hurry_s` one visit follows the other, so that pools which grow with each visit, ever
        less, have grown. What is counted; and the last `failure`, in words."""
        unhurried, failure = time.monotonic() + hurry_s, ""
        while not stop.wait(pause_s if time.monotonic() > unhurried else 0.0):
            self.counts["visits"] += 1
            for what in (self._by_zenoh, self._by_osc, self._at_the_page):
                try:
                    what()
                except (OSError, ValueError, TimeoutError) as error:
                    self.counts["failed"] += 1
                    failure = f"visit {self.counts['visits']}{what.__name__.replace('_', ' ')}: {error}"
                    print(failure, file=sys.stderr, flush=True)
        return {**self.counts, "failure": failure}

    def _by_zenoh(self) -> None:
        until = time.monotonic() + _PATIENCE_S
        session = open_client(self._where.endpoint, lambda: time.monotonic() < until)
        if session is None:
            raise TimeoutError(f"no router at {self._where.endpoint}")
        try:
            keys = self._keys

            def ask(key: str, payload: bytes | None = None) -> bytes:
                for reply in session.get(key, payload=payload, timeout=_PATIENCE_S):
                    if reply.ok is not None:
                        self.counts["answers"] += 1
                        return reply.ok.payload.to_bytes()
                    said = reply.err.payload.to_bytes() if reply.err is not None else b""
                    raise ValueError(f"{key} refused: {said!r}")
                raise TimeoutError(f"nobody answered {key}")

            own = float(msgspec.msgpack.decode(ask(keys.param(self._parameter)))[1])
            self._value = own if self._value is None else self._value
            more = _CHANGE * (self.counts["visits"] % 2)
            ask(keys.set_one(self._parameter), msgspec.msgpack.encode([1, self._value * (1.0 + more)]))
            ask(keys.clock)
            ask(keys.doctor)
            for seconds in (1.0, 0.0):
                ask(keys.lease, encode(LeaseRequest(who=_NAME, name=_NAME, seconds=seconds)))
            if self.counts["visits"] % _PRESET_EVERY == 0:
                ask(keys.preset_save, msgspec.msgpack.encode([1, _NAME]))
                ask(keys.preset_load, msgspec.msgpack.encode([1, _NAME]))
                ask(keys.preset)
        finally:
            session.close()

    def _by_osc(self) -> None:
        from pythonosc.osc_message import OscMessage
        from pythonosc.osc_message_builder import OscMessageBuilder

        def message(row: str, *arguments: int | float) -> bytes:
            builder = OscMessageBuilder(f"{osc.DEFAULT_PREFIX}{row}")
            for argument in arguments:
                builder.add_arg(argument)
            return builder.build().dgram

        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.bind(("127.0.0.1", 0))
            udp.settimeout(_PATIENCE_S)
            udp.connect(("127.0.0.1", self._where.osc_port))
            own_port = int(udp.getsockname()[1])
            udp.send(message("/subscribe", own_port))
            udp.send(message("/sync"))
            udp.send(message(f"/param/{self._parameter}", self._value or 0.0))
            udp.send(message(f"/param/{self._parameter}"))
            udp.send(message("/nonsense", 1.0))  # a mistake is answered too
            udp.send(message("/ping", self.counts["visits"]))
            until = time.monotonic() + _PATIENCE_S
            while OscMessage(udp.recv(65536)).address != f"{osc.DEFAULT_PREFIX}/pong":
                self.counts["datagrams"] += 1
                if time.monotonic() > until:
                    raise TimeoutError("no /pong")
            udp.send(message("/unsubscribe", own_port))

    def _at_the_page(self) -> None:
        from websockets.exceptions import WebSocketException
        from websockets.sync.client import connect
        from websockets.typing import Subprotocol

        port, token = self._where.panel_port, self._where.token_file.read_text(encoding="ascii").strip()
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/?token={token}", timeout=_PATIENCE_S) as page:
            self.counts["page_bytes"] += len(page.read())
        try:
            with connect(
                f"ws://127.0.0.1:{port}/",
                additional_headers={"Cookie": f"drumstick_panel_{port}={token}"},
                subprotocols=[Subprotocol(f"viser-v{version('viser')}")],
                open_timeout=_PATIENCE_S,
                max_size=None,
            ) as wire:
                until = time.monotonic() + _LOOKS_S
                while (left := until - time.monotonic()) > 0.0:
                    wire.recv(timeout=left)
                    self.counts["page_frames"] += 1
        except TimeoutError:
            return  # nothing new on the page for the rest of the look
        except WebSocketException as error:
            raise OSError(f"the page's websocket: {error!r}") from None
