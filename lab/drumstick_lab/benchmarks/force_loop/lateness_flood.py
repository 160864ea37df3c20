"""The floods of lateness.py, each in a process of its own until SIGTERM; then one line of JSON: what was sent.

osc: datagrams to the instrument's OSC port, nine sets of dv_pls in ten and a wrong address. zenoh: queries to set
dv_pls, each answered or refused by the gateway. block: whole sets, offered in the gateway's place by its own code.
Paced in millisecond bursts; a sender that falls behind counts what it left out and does not catch up.
"""

import argparse
import json
import signal
import socket
import time
from collections.abc import Callable
from pathlib import Path

import msgspec
import zenoh
from pythonosc.osc_message_builder import OscMessageBuilder

from drumstick.scenes.scene_text import parse
from drumstick.stick.law import law_of
from haptic_server import files
from haptic_server.gateway.link import ServoLink
from protocol.keys import Keys
from protocol.session import client_config
from realtime.stop import StopRequest

LOW, HIGH = 0.1, 0.3  # m/s, inside the envelope of the scene roll
_BURST_S = 0.001


def value(i: int) -> float:
    return LOW + (HIGH - LOW) * (i % 97) / 96.0


def paced(send: Callable[[int], bool], rate_hz: int, stop: StopRequest) -> dict[str, float]:
    """Call `send` at `rate_hz` until asked to stop; it says whether it sent."""
    burst = max(1, round(rate_hz * _BURST_S))
    begun = due = time.monotonic()
    count = left_out = sent = 0
    while not stop.is_set():
        for _ in range(burst):
            sent += send(count)
            count += 1
        due += burst / rate_hz
        wait = due - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        elif wait < -0.05:
            left_out += round(-wait * rate_hz)
            due = time.monotonic()
    seconds = time.monotonic() - begun
    return {"seconds": seconds, "sent_per_s": sent / seconds, "left_out_per_s": left_out / seconds}


def osc(port: int, rate_hz: int, stop: StopRequest) -> dict[str, float]:
    def built(address: str, number: float) -> bytes:
        message = OscMessageBuilder(address)
        message.add_arg(number, "f")
        return message.build().dgram

    packets = [built("/drumstick/param/dv_pls", value(i)) for i in range(97)]
    packets[::10] = [built("/drumstick/no/such", 0.0)] * len(packets[::10])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.connect(("127.0.0.1", port))
        udp.setblocking(False)

        def send(i: int) -> bool:
            try:
                udp.send(packets[i % 97])
            except OSError:  # a full buffer
                return False
            return True

        return paced(send, rate_hz, stop)


def over_zenoh(endpoint: str, rig: str, rate_hz: int, stop: StopRequest) -> dict[str, float]:
    payloads = [msgspec.msgpack.encode([1, {"dv_pls": value(i)}]) for i in range(97)]
    with zenoh.open(client_config(endpoint)) as session:
        querier = session.declare_querier(Keys(rig).set_many, timeout=1.0)

        def send(i: int) -> bool:
            # Answers go into a channel that nobody reads: in a callback of Python they would cost ten times the asking.
            querier.get(zenoh.handlers.RingChannel(1), payload=payloads[i % 97])
            return True

        return paced(send, rate_hz, stop)


def into_the_block(run_dir: Path, rate_hz: int, stop: StopRequest) -> dict[str, float]:
    scene = parse((run_dir / files.SCENE).read_text(encoding="utf-8"), "scene")
    law = law_of(scene)
    link = ServoLink(run_dir, law)

    def send(i: int) -> bool:
        law["pulse"]["dv_pls"] = value(i)
        link.offer(i + 1, law)
        return True

    return paced(send, rate_hz, stop)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("kind", choices=("osc", "zenoh", "block"))
    arguments.add_argument("target", nargs="+", help="osc: port; zenoh: endpoint and rig; block: run folder")
    arguments.add_argument("--rate", type=int, required=True)
    given = arguments.parse_args()
    stop = StopRequest()
    signal.signal(signal.SIGTERM, stop.ask)
    if given.kind == "osc":
        said = osc(int(given.target[0]), given.rate, stop)
    elif given.kind == "zenoh":
        said = over_zenoh(given.target[0], given.target[1], given.rate, stop)
    else:
        said = into_the_block(Path(given.target[0]), given.rate, stop)
    print(json.dumps(said), flush=True)


if __name__ == "__main__":
    main()
