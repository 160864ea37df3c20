"""Mutated OSC messages, from a seed: what a broken program, a bad cable or somebody with time might send."""

import math
import random
import struct

from pythonosc.osc_message_builder import OscMessageBuilder

P = "/drumstick"
# Mutants can be subscriptions to any port: from this loopback address they reach nobody who listens at 127.0.0.1.
MUTANT_HOST = "127.77.0.1"


def _built(address: str, *args: int | float | str) -> bytes:
    builder = OscMessageBuilder(address)
    for arg in args:
        builder.add_arg(arg)
    return builder.build().dgram


GOOD = [
    _built(P + "/param/dv_pls", 0.3),
    _built(P + "/param/k_coll", 4000),
    _built(P + "/param/tau/norm", 0.5),
    _built(P + "/param/r_in"),
    _built(P + "/sync"),
    _built(P + "/ping", 1, 0.5, "text", 2),
    _built(P + "/subscribe", 9000),
    _built(P + "/unsubscribe", 9000),
    _built(P + "/panic"),
    _built(P + "/preset/load", "slow"),
    _built(P + "/lease", "Eve"),
    _built(P + "/scene/load", "tom"),
    _built(P + "/scene/next", 1.0),
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


def mutant(chance: random.Random) -> bytes:
    """One message that was good, changed in one to three places."""
    packet = bytearray(chance.choice(GOOD))
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
                packet += chance.choice(GOOD) * chance.choice([1, 1, 40])
    if chance.random() < 0.7:  # most of them pass the first test, so that the later ones get work
        packet += bytes(-len(packet) % 4)
    return bytes(packet)


# What ended or stopped python-osc's own servers: a bundle whose element has a negative size (an endless loop), a time
# far in the future (a thread that sleeps until then), patterns that match for ever.
KILLERS = [
    b"#bundle\0" + struct.pack(">Q", 1) + struct.pack(">i", -4) + bytes(8),
    b"#bundle\0"
    + struct.pack(">Q", 2**63)
    + struct.pack(">i", 16)
    + _built(P + "/ping")[:16].ljust(16, b"\0"),
    _built("/" + "*" * 64 + "!", 1),
    _built("/" + "{a,b}" * 20, 1),
    b"#bundle\0" + struct.pack(">Q", 1) + struct.pack(">i", 2**31 - 1),
    b"#bundle\0" * 40,
]
