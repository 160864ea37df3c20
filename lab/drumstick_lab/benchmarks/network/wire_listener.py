"""Listens to strikes in a process of its own and writes when each came: python wire_listener.py OUT.npy KIND WHERE [N].

KIND: osc or bare (WHERE is a UDP port of 127.0.0.1), or zenoh (WHERE is the router; N sessions, each with one
subscriber). OUT holds an array of (number, monotonic ns) for each subscriber. Ends at the end of its input.
"""

import socket
import sys
import threading
import time

import numpy as np
import zenoh

from drumstick_lab.benchmarks.network.wire_servo import BARE
from protocol.keys import Keys
from protocol.messages import Strike, decode
from protocol.session import open_client

Heard = list[tuple[int, int]]


def datagrams(kind: str, port: int, ended: threading.Event) -> list[Heard]:
    """Receive datagrams until `ended`."""
    from pythonosc.osc_message import OscMessage

    heard: Heard = []
    raw: list[tuple[bytes, int]] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        udp.bind(("127.0.0.1", port))
        udp.settimeout(0.2)
        print("ready", flush=True)
        while not ended.is_set():
            try:
                packet = udp.recv(2048)
            except TimeoutError:
                continue
            raw.append((packet, time.monotonic_ns()))
    for packet, came_ns in raw:  # read afterwards: a listener in C would not take this long
        if kind == "bare":
            heard.append((BARE.unpack(packet)[0], came_ns))
        elif packet.startswith(b"/drumstick/strike\0"):
            heard.append((int(OscMessage(packet).params[0]), came_ns))
    return [heard]


def samples(endpoint: str, sessions: int, ended: threading.Event) -> list[Heard]:
    """Receive samples until `ended`; reports the strikes' numbers and when the callbacks ran."""
    raw: list[list[tuple[zenoh.ZBytes, int]]] = [[] for _ in range(sessions)]
    opened = []
    for each in raw:
        session = open_client(endpoint, lambda: True)
        assert session is not None
        session.declare_subscriber(
            Keys("wire").strike, lambda sample, each=each: each.append((sample.payload, time.monotonic_ns()))
        )
        opened.append(session)
    print("ready", flush=True)
    ended.wait()
    for session in opened:
        session.close()
    return [[(decode(payload.to_bytes(), Strike).seq, came) for payload, came in each] for each in raw]


def main(out: str, kind: str, where: str, sessions: int) -> None:
    """Listen and write."""
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    heard = samples(where, sessions, ended) if kind == "zenoh" else datagrams(kind, int(where), ended)
    arrays = {str(i): np.array(h, np.int64).reshape(-1, 2) for i, h in enumerate(heard)}
    np.savez(out, **arrays)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]) if len(sys.argv) > 4 else 1)
