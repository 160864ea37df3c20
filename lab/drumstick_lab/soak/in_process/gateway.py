"""A whole gateway on a servo in virtual time: relay, settings, wire, OSC server and presets. Only Zenoh is stood in for."""

import json
import socket
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, cast

from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import as_tables
from drumstick.scenes.table import Refusal, values_of
from drumstick.stick.law import law_of
from drumstick_lab.soak.in_process.local_wire import LocalSession
from drumstick_lab.soak.listeners import OSC_NUMBERS, Sequence
from haptic_server import limits
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.presets import Presets
from haptic_server.gateway.relay import Relay, Wires
from haptic_server.gateway.scenes.requests import SceneRequests
from haptic_server.gateway.settings import Parameters
from haptic_server.gateway.zenoh.wire import Wire
from haptic_server.presets.store import PresetStore
from haptic_server.servo.device.simulated import Simulated
from protocol import osc
from protocol.keys import Keys
from protocol.requests import Claim

_CHANGE = 0.01
_RECEIVE_BYTES = 1 << 22
_PONG_WITHIN_S = 10.0
_PRESETS = 3
_WALL_S = 1_800_000_000
_WALL_STEP_S = 3600  # somebody sets the time of day, back and forth


class Gateway:
    """On the block in `folder`; time is what `step` is given. The OSC server's own thread runs as ever."""

    def __init__(self, scene: Scene, folder: Path, session: LocalSession) -> None:
        law = law_of(scene)
        self._now_s = 0.0
        self._session = session
        self.keys = Keys("soak")
        self.link = ServoLink(folder, law)
        held = limits.limits_of(scene, Simulated(scene).info().specification)
        self.parameters = Parameters(scene, self.link, held, self._now)
        scene_values = values_of(law, self.parameters.table)
        self._moved = next(name for name in ("dv_pls", "gamma", "k_hand") if name in self.parameters.table)
        self._value = scene_values[self._moved]
        self._presets = Presets(
            PresetStore(folder / "state", sync=lambda _: None),
            self.parameters,
            scene.name,
            scene_values,
            self._wall,
        )
        self._listener = _listening()
        self.osc = OscServer(
            ("127.0.0.1", 0), [self._listener.getsockname()], osc.DEFAULT_PREFIX, self.parameters, self._presets.load,
            now=self._now,
        )  # fmt: skip
        self._wire = Wire(
            cast(Any, session), self.keys, self.parameters, lambda: self.link.boot, json.dumps(as_tables(scene)), dict,
            self._presets, SceneRequests(folder, False, self.parameters.require_quiet),
        )  # fmt: skip
        self._relay = Relay("soak", self.link, self.parameters, Wires(self._wire, self.osc))
        self.heard = Sequence()
        self.visits = 0
        self.refused = 0

    def _now(self) -> float:
        return self._now_s

    def _wall(self) -> str:
        # Stepped by an hour, there and back, at every visit.
        at = _WALL_S + self._now_s + _WALL_STEP_S * (self.visits % 2)
        return datetime.fromtimestamp(at, UTC).isoformat(timespec="seconds")

    def step(self, now_ns: int) -> None:
        """One round of the relay; what it sent by OSC is read."""
        self._now_s = now_ns * 1e-9
        self._relay.step(now_ns)
        self._read()

    def _read(self) -> None:
        from pythonosc.osc_message import OscMessage

        while True:
            try:
                datagram = self._listener.recv(65536)
            except BlockingIOError:
                return
            if datagram.startswith(b"/drumstick/strike\0"):
                self.heard.note(0, int(OscMessage(datagram).params[0]), OSC_NUMBERS)
            else:
                self.heard.other += 1

    def visit(self) -> None:
        """Somebody new comes by OSC, sets, asks, errs, subscribes, and goes; presets are saved, listed and loaded."""
        from pythonosc.osc_message_builder import OscMessageBuilder

        self.visits += 1
        value = self._value * (1.0 + _CHANGE * (self.visits % 2))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
            udp.bind(("127.0.0.1", 0))
            udp.settimeout(_PONG_WITHIN_S)
            port = int(udp.getsockname()[1])
            for row, argument in (
                ("/subscribe", port),
                (f"/param/{self._moved}", value),
                (f"/param/{self._moved}/norm", 2.0),  # beyond the range: refused
                ("/sync", None),
                ("/nonsense", 1),
                ("/unsubscribe", port),
                ("/ping", self.visits),
            ):
                builder = OscMessageBuilder(f"{osc.DEFAULT_PREFIX}{row}")
                if argument is not None:
                    builder.add_arg(argument)
                udp.sendto(builder.build().dgram, self.osc.endpoint)
            _await_pong(udp)
        name = f"soak {self.visits % _PRESETS}"
        try:
            self._presets.save(name, "soak")
            self._presets.load(name, "soak", Claim())
        except Refusal:
            self.refused += 1
        self._presets.list()

    def close(self) -> None:
        """End its threads and sockets."""
        self.osc.close()
        self._wire.close()
        self._listener.close()


def _listening() -> socket.socket:
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BYTES)
    udp.bind(("127.0.0.1", 0))
    udp.setblocking(False)
    return udp


def _await_pong(udp: socket.socket) -> None:
    until = time.monotonic() + _PONG_WITHIN_S
    while not udp.recv(65536).startswith(b"/drumstick/pong\0"):
        if time.monotonic() > until:
            raise TimeoutError("the OSC server answered no /ping")
