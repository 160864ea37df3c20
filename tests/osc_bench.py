"""Fixtures of the OSC tests: parameters without a servo, time that a test moves, clients on loopback."""

import math
import socket
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib import resources
from typing import Any

from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder

from drumstick.scenes.scene_text import parse
from drumstick.scenes.table import Refusal, table_of, values_of, with_changes
from drumstick.stick.law import law_of
from haptic_server.gateway.lease import Lease, LeaseHolder
from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.rounding import is_same
from haptic_server.presets.preset import PresetError
from protocol.messages import Release, SetReply, Strike
from protocol.requests import ANYBODY, Claim

BOUND_S = 120.0  # how long a test waits for something that must come
_LAST = "/behind/all"
STRIKE = Strike(
    boot=1,
    seq=9,
    t_ns=5,
    x=0.5,
    y=-0.25,
    z_speed_m_per_s=1.5,
    level=0.75,
    peak_estimate_N=12.5,
    contact_estimate_s=0.005,
)
RELEASE = Release(
    boot=1, seq=9, t_ns=6, exit_speed_m_per_s=1.25, impulse_N_s=0.03125, peak_N=13.0, contact_s=0.0078125
)


class FakeParameters:
    """Accepts what the table's ranges allow; `after_set`, if given, is called with what a servo would have latched."""

    def __init__(self) -> None:
        text = (resources.files("drumstick.scenes") / "shipped" / "roll.toml").read_text()
        scene = parse(text, "roll")
        self.table = table_of(scene)
        self._law = law_of(scene)
        self.asked: list[dict[str, float]] = []
        self.sets: list[tuple[dict[str, float], str]] = []
        self.panics: list[str] = []
        self.after_set: Callable[[str, float, float], None] | None = None
        self.broken = False
        self.lease = Lease()
        self.now_s = 0.0
        self.panicked = threading.Event()

    def values(self) -> dict[str, float]:
        if self.broken:
            raise RuntimeError("the block is gone")
        return values_of(self._law, self.table)

    def accepted_values(self) -> dict[str, float]:
        return self.values()

    def take_lease(self, who: str, name: str, seconds: float) -> LeaseHolder:
        return self.lease.take(who, name, seconds, self.now_s)

    def require_free(self, claim: Claim) -> None:
        self.lease.require(claim.lease, self.now_s)

    def load_preset(self, name: str, source: str, claim: Claim) -> SetReply:
        if name != "slow":
            raise PresetError(f"no preset {name!r}")
        return self.set({"dv_pls": 0.1, "k_hand": 20.0}, f"preset {name} by {source}", claim)

    def set(self, changes: Mapping[str, float], source: str, claim: Claim = ANYBODY) -> SetReply:
        self.lease.require(claim.lease, self.now_s)
        self.asked.append(dict(changes))
        if changes.get("dv_pls", 0.0) > 5.0:
            raise Refusal("dv_pls: the roll could reach 20 m/s, the limit is 10 m/s")
        before = self.values()
        law = with_changes(self._law, self.table, changes)
        if all(is_same(value, before[name]) for name, value in changes.items()):
            return SetReply(values={n: before[n] for n in changes}, revision=len(self.sets), pending=False)
        self._law = law
        self.sets.append((dict(changes), source))
        values = self.values()
        if self.after_set is not None:
            for name in changes:
                self.after_set(name, values[name], self.table[name].norm(values[name]))
        return SetReply(values={n: values[n] for n in changes}, revision=len(self.sets), pending=True)

    def lose_z_h0(self) -> None:
        self._law = with_changes(self._law, self.table, {"k_hand": 0.0})
        assert math.isnan(self.values()["z_h0"])

    def panic(self, source: str) -> None:
        self.panics.append(source)
        self.panicked.set()


def no_preset(name: str, _source: str, _claim: Claim) -> None:
    raise PresetError(f"no preset {name!r}")


def built(address: str, *args: int | float | str) -> bytes:
    """A message as python-osc builds it: i for int, f for float, s for str."""
    builder = OscMessageBuilder(address)
    for arg in args:
        builder.add_arg(arg)
    return builder.build().dgram


class Time:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.s = 1000.25

    def __call__(self) -> float:
        return self.s


class Client:
    """A UDP port on loopback that speaks OSC through python-osc, and reads with it too."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        self.udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.udp.bind((host, 0))
        self.udp.settimeout(BOUND_S)
        self.endpoint: tuple[str, int] = self.udp.getsockname()

    def next(self) -> tuple[str, list[Any]]:
        """The next message; TimeoutError when there is none."""
        message = OscMessage(self.udp.recv(65536))
        return message.address, message.params

    def waiting(self) -> list[tuple[str, list[Any]]]:
        """Messages that were sent here before now: one of its own comes behind them."""
        found: list[tuple[str, list[Any]]] = []
        self.udp.sendto(built(_LAST), self.endpoint)
        while (one := self.next())[0] != _LAST:
            found.append(one)
        return found


@contextmanager
def client(host: str = "127.0.0.1") -> Iterator[Client]:
    made = Client(host)
    try:
        yield made
    finally:
        made.udp.close()


def tell(front: OscServer, sender: Client, datagram: bytes) -> list[tuple[str, list[Any]]]:
    """Deliver a datagram, without the front's socket, and return what the sender has got."""
    front.receive(datagram, sender.endpoint)
    return sender.waiting()


@contextmanager
def opened_front(parameters: FakeParameters, *targets: Client, **options: object) -> Iterator[OscServer]:
    front = OscServer(
        ("127.0.0.1", 0),
        [t.endpoint for t in targets],
        "/drumstick",
        parameters,
        parameters.load_preset,
        **options,  # type: ignore[arg-type]
    )
    try:
        yield front
    finally:
        front.close()
