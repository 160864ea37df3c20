"""Delay that the public listener adds to a message: drumstick lab door [--messages 3000].

From a put in the gateway's place to a callback in a client of the same machine: one on loopback TCP, one with a
listener's certificate over TLS through the door; also while fifty handshakes a second fail. Both take each message of
the same series. The clients and the putting session are one Python process, so its own switching is part of both.
"""

import argparse
import json
import socket
import tempfile
import threading
import time
from pathlib import Path
from subprocess import DEVNULL, Popen
from typing import Any

import numpy as np
import zenoh
from rig_process import free_port, wait_for

from drumstick_lab.measuring import stored
from haptic_server.access.options import AccessOptions
from made_keys import Keyring
from protocol.access.roles import ROLES
from protocol.keys import Keys
from protocol.session import Public, client_config, open_client, open_router
from realtime.service_options import command

KEYS = Keys("bench")
_EVERY_S = 0.002
_FAILED_PER_S = 50


def latencies_us(source: zenoh.Session, clients: dict[str, zenoh.Session], messages: int) -> dict[str, Any]:
    """p50 and p99 of each client over one series, and how many did not come."""
    found: dict[str, list[float]] = {name: [] for name in clients}

    def note(name: str) -> Any:
        def take(sample: zenoh.Sample) -> None:
            found[name].append((time.perf_counter_ns() - int(sample.payload.to_bytes())) * 1e-3)

        return zenoh.handlers.Callback(take, indirect=False)

    subscribers = [each.declare_subscriber(KEYS.strike, note(name)) for name, each in clients.items()]
    publisher = source.declare_publisher(KEYS.strike)
    time.sleep(1.0)
    for _ in range(messages):
        publisher.put(str(time.perf_counter_ns()).encode())
        time.sleep(_EVERY_S)
    time.sleep(0.5)
    for each in (*subscribers, publisher):
        each.undeclare()
    return {
        name: {
            "p50_us": float(np.percentile(us, 50)),
            "p99_us": float(np.percentile(us, 99)),
            "lost": messages - len(us),
        }
        for name, us in found.items()
    }


class Knocking:
    """Connections that are no TLS at all, each a handshake that fails."""

    def __init__(self, port: int) -> None:
        self._port, self._stop, self.tries = port, threading.Event(), 0
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        while not self._stop.wait(1.0 / _FAILED_PER_S):
            with socket.create_connection(("127.0.0.1", self._port), timeout=5.0) as link:
                link.sendall(b"GET / HTTP/1.0\r\n\r\n")
            self.tries += 1

    def __enter__(self) -> "Knocking":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=3000)
    given = parser.parse_args()
    port, local = free_port(), f"tcp/127.0.0.1:{free_port()}"
    public = f"tls/127.0.0.1:{port}"
    with tempfile.TemporaryDirectory() as folder, open_router(local) as source:
        keyring = Keyring(Path(folder) / "keys")
        listener = Public(public, keyring.listener(), (KEYS.rig,), tuple(ROLES))
        options = AccessOptions(connect=local, public=listener)
        door = Popen(command("haptic_server.access", options), stderr=DEVNULL)
        try:
            far = open_client(public, lambda: door.poll() is None, keyring.identity("listener"))
            assert far is not None
            with far, zenoh.open(client_config(local)) as near:
                clients = {"loopback": near, "door": far}
                rows = {"alone": latencies_us(source, clients, given.messages)}
                with Knocking(port) as knocking:
                    rows["while handshakes fail"] = latencies_us(source, clients, given.messages)
                answer = wait_for("the count", lambda: list(near.get(KEYS.door, timeout=2.0)))[0].ok
                counted = json.loads(answer.payload.to_bytes())["handshakes_refused"]
        finally:
            door.terminate()
            door.wait(10.0)
    result = {
        "messages": given.messages,
        "rows": rows,
        "knocked": knocking.tries,
        "refused_and_counted": counted,
    }
    stored.store("door", result)
    print(json.dumps(result["rows"], indent=1), knocking.tries, counted)


if __name__ == "__main__":
    main()
