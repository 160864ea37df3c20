"""Mutated messages by the thousand: none stops the front, and every good message between them is served."""

import math
import random
import socket
import struct

from haptic_server.gateway.osc.front import OscFront
from osc_bench import FakeDesk, Time, built, client, opened_front, tell

P = "/drumstick"
# Mutants can be subscriptions to any port: from this loopback address they reach nobody who listens at 127.0.0.1.
_MUTANT_HOST = "127.77.0.1"
_GOOD = [
    built(P + "/param/dv_pls", 0.3),
    built(P + "/param/k_coll", 4000),
    built(P + "/param/tau/norm", 0.5),
    built(P + "/param/r_in"),
    built(P + "/sync"),
    built(P + "/ping", 1, 0.5, "text", 2),
    built(P + "/subscribe", 9000),
    built(P + "/unsubscribe", 9000),
    built(P + "/panic"),
]
_SEASONING = [
    b"#bundle\0" + bytes(8),
    b"#bundle\0" + struct.pack(">Qi", 2**63, -4),
    struct.pack(">i", -1),
    struct.pack(">i", 2**31 - 1),
    struct.pack(">f", math.nan),
    struct.pack(">f", -math.inf),
    b"*" * 40,
    b"{a,b}[!c]?",
    b",",
    b",sssssss\0\0\0\0",
    b",[[]]\0\0\0",
    b"\0\0\0\0",
    b"/",
    "ü".encode(),
]


def _mutant(chance: random.Random) -> bytes:
    packet = bytearray(chance.choice(_GOOD))
    for _ in range(chance.choice([1, 1, 2, 3])):
        at = chance.randrange(len(packet) + 1)
        match chance.randrange(7):
            case 0 if at < len(packet):
                packet[at] = chance.randrange(256)
            case 1:
                del packet[at:]
            case 2:
                packet[at:at] = chance.choice(_SEASONING)
            case 3:
                packet[at : at + 4] = chance.choice(_SEASONING)
            case 4:
                word = (at - 1) & ~3 if at else 0
                packet[word : word + 4] = chance.choice([chance.randbytes(4), *_SEASONING[2:6]])
            case 5:
                comma = packet.find(b",")
                if comma >= 0:
                    packet[comma + 1 : comma + 3] = bytes(chance.choices(b"ifsdbhtTFNI[]", k=2))
            case _:
                packet += chance.choice(_GOOD) * chance.choice([1, 1, 40])
    if chance.random() < 0.7:  # most of them pass the first test, so that the later ones get work
        packet += bytes(-len(packet) % 4)
    return bytes(packet)


def _assert_serves(front: OscFront, desk: FakeDesk, time: Time) -> None:
    with client() as good:
        assert tell(front, good, built(P + "/ping", 7)) == [("/drumstick/pong", [7])]
        assert len(tell(front, good, built(P + "/param/m"))) == 2
        time.s += 1.0
        sets, panics = len(desk.sets), len(desk.panics)
        front.hear(built(P + "/param/r_in", 1.0), good.endpoint)
        front.hear(built(P + "/panic"), good.endpoint)
        assert (len(desk.sets), len(desk.panics)) == (sets + 1, panics + 1)


def test_twenty_thousand_mutants() -> None:
    chance, desk, time = random.Random(20070827), FakeDesk(), Time()
    with opened_front(desk, now=time) as front:
        good = 0
        for i in range(20_000):
            time.s += 0.001
            front.hear(_mutant(chance), (_MUTANT_HOST, 40000 + i % 50))
            if i % 500 == 0:
                _assert_serves(front, desk, time)
                good += 4
        heard = front.counters
        heard = {k: n for k, n in heard.items() if not k.startswith("send")}
        assert sum(heard.values()) == 20_000 + good  # each is served, or refused for one reason
        assert "fault" not in heard
        # The mutations are worth something: all kinds of refusal occur, and much is still served.
        assert {"unreadable", "address", "arguments", "value", "served"} <= set(heard)
        assert heard["served"] > 300 + good
        assert all(
            math.isfinite(v) and desk.table[n].quantity.low <= v <= desk.table[n].quantity.high
            for values, _ in desk.sets
            for n, v in values.items()
        )


def test_mutants_through_the_socket() -> None:
    chance, desk = random.Random(4), FakeDesk()
    mutants = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    mutants.bind((_MUTANT_HOST, 0))
    with mutants, client() as good, opened_front(desk) as front:
        for i in range(300):
            mutants.sendto(_mutant(chance), front.endpoint)
            if i % 10 == 0:
                good.udp.sendto(built(P + "/ping", i), front.endpoint)
                assert good.next() == ("/drumstick/pong", [i])
        assert "fault" not in front.counters
