"""The gateway's ear for pointers: heard only by a servo that follows one, one holder at a time, floods bounded."""

import time
from collections.abc import Callable, Iterator

import msgspec
import pytest
import zenoh

from guarded_router import joined
from haptic_server.gateway.zenoh.pointer_input import SILENT_NS, PointerHolder, Pointing
from protocol.keys import Keys
from protocol.messages import Pointer, encode
from protocol.session import router_config

KEYS = Keys("main")


def pointer(source: str = "a", seq: int = 1, held: bool = True, lift: float = 0.5) -> Pointer:
    return Pointer(source=source, seq=seq, held=held, lift=lift, x=0.1, y=-0.2)


def test_the_first_who_holds_keeps_it_until_he_lets_go() -> None:
    holder = PointerHolder()
    assert holder.admits(pointer("a", 1), 0)
    assert not holder.admits(pointer("b", 1), 1)
    assert holder.admits(pointer("a", 2), 2)
    assert holder.admits(pointer("a", 3, held=False), 3)
    assert holder.admits(pointer("b", 2), 4)
    assert not holder.admits(pointer("a", 4), 5)


def test_or_falls_silent() -> None:
    holder = PointerHolder()
    assert holder.admits(pointer("a", 1), 0)
    assert not holder.admits(pointer("b", 1), SILENT_NS)
    assert holder.admits(pointer("b", 2), SILENT_NS + 1)
    assert not holder.admits(pointer("a", 2), SILENT_NS + 2)


def test_what_was_overtaken_does_not_count() -> None:
    holder = PointerHolder()
    assert holder.admits(pointer("a", 7), 0)
    assert not holder.admits(pointer("a", 6), 1)
    assert not holder.admits(pointer("a", 7), 1)
    assert holder.admits(pointer("a", 8), 1)


def test_letting_go_takes_nothing_over() -> None:
    holder = PointerHolder()
    assert not holder.admits(pointer("b", 1, held=False), 0)
    assert holder.admits(pointer("a", 1), 1)


class Servo:
    """Stand-in of a ServoLink, as far as Pointing needs it."""

    def __init__(self, is_pointed: bool) -> None:
        self.boot = 5
        self.is_pointed = is_pointed
        self.told: list[tuple[bool, float, float, float]] = []

    def point(self, held: bool, lift: float, x: float, y: float) -> None:
        self.told.append((held, lift, x, y))


@pytest.fixture
def wire(free_port: Callable[[], int]) -> Iterator[tuple[zenoh.Session, zenoh.Session]]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with zenoh.open(router_config(endpoint)) as router, joined(endpoint) as client:
        yield router, client


def tokens(client: zenoh.Session) -> list[str]:
    replies = client.liveliness().get(KEYS.alive("pointer", "*"), timeout=60.0)
    return [str(reply.ok.key_expr) for reply in replies if reply.ok]


def steps(pointing: Pointing, until: Callable[[], object], timeout_s: float = 60.0) -> bool:
    end = time.monotonic() + timeout_s
    while time.monotonic() < end:
        pointing.step(time.monotonic_ns())
        if until():
            return True
        time.sleep(0.001)
    return False


def test_a_pointer_reaches_the_servo_cut_to_its_range(wire: tuple[zenoh.Session, zenoh.Session]) -> None:
    router, client = wire
    servo = Servo(is_pointed=True)
    pointing = Pointing(router, KEYS, servo)
    pointing.step(0)
    assert tokens(client) == [KEYS.alive("pointer", "5")]
    client.put(KEYS.pointer, encode(pointer(lift=7.0)))
    assert steps(pointing, lambda: servo.told)
    assert servo.told == [(True, 1.0, 0.1, -0.2)]


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"rubbish",
        msgspec.msgpack.encode([1, "a", 2, True, float("nan"), 0.0, 0.0]),
        msgspec.msgpack.encode([1, "a", 2, True, float("inf"), 0.0, 0.0]),
        msgspec.msgpack.encode([2, "a", 2, True, 0.0, 0.0, 0.0]),
        msgspec.msgpack.encode([1, "a", 2, True, 0.0]),
        msgspec.msgpack.encode([1, "a", 2, "yes", 0.0, 0.0, 0.0]),
    ],
)
def test_rubbish_is_passed_over(wire: tuple[zenoh.Session, zenoh.Session], payload: bytes) -> None:
    router, client = wire
    servo = Servo(is_pointed=True)
    pointing = Pointing(router, KEYS, servo)
    pointing.step(0)
    client.put(KEYS.pointer, payload)
    client.put(KEYS.pointer, encode(pointer(seq=9)))
    assert steps(pointing, lambda: servo.told)
    assert [told[1] for told in servo.told] == [0.5]


def test_a_servo_of_another_device_hears_nothing(wire: tuple[zenoh.Session, zenoh.Session]) -> None:
    router, client = wire
    arm, marker = Servo(is_pointed=False), Servo(is_pointed=True)
    pointing = Pointing(router, KEYS, arm)
    pointing.step(0)
    assert tokens(client) == []
    witness = Pointing(router, KEYS, marker)
    witness.step(0)
    client.put(KEYS.pointer, encode(pointer()))
    assert steps(witness, lambda: marker.told)
    pointing.step(1)
    assert arm.told == []


def test_it_goes_with_the_servo(wire: tuple[zenoh.Session, zenoh.Session]) -> None:
    """A servo that is restarted has another boot, and perhaps another device."""
    router, client = wire
    servo = Servo(is_pointed=False)
    pointing = Pointing(router, KEYS, servo)
    pointing.step(0)
    servo.boot, servo.is_pointed = 6, True
    pointing.step(1)
    assert tokens(client) == [KEYS.alive("pointer", "6")]
    servo.boot, servo.is_pointed = 7, False
    pointing.step(2)
    assert tokens(client) == []


def test_a_flood_costs_a_few_messages_a_round(wire: tuple[zenoh.Session, zenoh.Session]) -> None:
    """And he who points on afterwards is heard; of the flood itself Zenoh may drop what no queue holds."""
    router, client = wire
    servo = Servo(is_pointed=True)
    pointing = Pointing(router, KEYS, servo)
    pointing.step(0)
    for seq in range(1, 5001):
        client.put(KEYS.pointer, encode(pointer(seq=seq)))
    most, before, seq = 0, 0, 5000

    def is_heard() -> bool:
        nonlocal most, before, seq
        most, before = max(most, len(servo.told) - before), len(servo.told)
        seq += 1
        client.put(KEYS.pointer, encode(pointer(seq=seq, lift=1.0)))
        return bool(servo.told) and servo.told[-1][1] == 1.0

    assert steps(pointing, is_heard)
    assert 1 <= most <= 8
