"""One end of drumstick lab listeners, a process of its own; it speaks in lines of JSON.

python listeners_end.py put ROUTER PROFILE SECONDS: puts what a rig puts, each message at its absolute time; says how
many. python listeners_end.py hear ROUTER PROFILE SESSIONS: as many sessions, each subscribed as the profile says;
at the end of its input it says what each heard, and how late the strikes came.
"""

import json
import sys
import time
from functools import partial
from typing import Any

import numpy as np
import zenoh

from drumstick_lab.rig_load import PROFILES, STREAMS
from protocol.messages import ENCODING, Strike, decode, encode
from protocol.session import open_client


def _session(router: str) -> zenoh.Session:
    session = open_client(router, lambda: True)
    assert session is not None
    return session


def put(router: str, profile: str, seconds: float) -> None:
    """Waits for a line before it begins."""
    session = _session(router)
    streams = [STREAMS[name] for name in PROFILES[profile]]
    publishers = [
        session.declare_publisher(stream.key, encoding=zenoh.Encoding(ENCODING)) for stream in streams
    ]
    due = sorted(
        (k / stream.per_s, which, k)
        for which, stream in enumerate(streams)
        for k in range(round(seconds * stream.per_s))
    )
    print(json.dumps("ready"), flush=True)
    sys.stdin.readline()
    begun = time.monotonic()
    late_s = 0.0
    for at_s, which, number in due:
        if (left := begun + at_s - time.monotonic()) > 0.0:
            time.sleep(left)
        late_s = max(late_s, time.monotonic() - begun - at_s)
        publishers[which].put(encode(streams[which].message(number, time.monotonic_ns())))
    print(json.dumps({"put": len(due), "latest_ms": round(1e3 * late_s, 1)}), flush=True)
    sys.stdin.readline()
    session.close()


def hear(router: str, profile: str, sessions: int) -> None:
    """Every callback runs on the thread that received: nothing more than counting is done there."""
    opened: list[zenoh.Session] = []
    strikes: list[tuple[Any, int]] = []
    counts = [0] * sessions

    def count(which: int, _: zenoh.Sample) -> None:
        counts[which] += 1

    def note(which: int, sample: zenoh.Sample) -> None:
        counts[which] += 1
        strikes.append((sample, time.monotonic_ns()))

    for which in range(sessions):
        session = _session(router)
        for name in PROFILES[profile]:
            take = partial(note if name == "strike" else count, which)
            session.declare_subscriber(STREAMS[name].key, zenoh.handlers.Callback(take, indirect=False))
        opened.append(session)
    print(json.dumps("ready"), flush=True)
    sys.stdin.read()
    late_us: list[float] = []
    foreign: list[str] = []
    for sample, came in strikes:
        try:
            late_us.append((came - decode(sample.payload.to_bytes(), Strike).t_ns) / 1e3)
        except ValueError as error:
            foreign.append(f"{sample.key_expr}: {error}")
    for session in opened:
        session.close()
    report = {"heard": counts, "late_us": np.round(late_us).astype(int).tolist(), "foreign": foreign}
    print(json.dumps(report), flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "put":
        put(sys.argv[2], sys.argv[3], float(sys.argv[4]))
    else:
        hear(sys.argv[2], sys.argv[3], int(sys.argv[4]))
