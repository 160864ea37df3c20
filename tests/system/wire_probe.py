"""Messages that are heard at one machine: python wire_probe.py RIG ENDPOINT [AUTHORITY CERTIFICATE KEY]

A line of JSON for each state, meter and strike: [kind, seconds of this machine's monotonic clock, fields].
"""

import json
import sys
import threading
import time
from pathlib import Path

import msgspec
import zenoh

from protocol.access.identity import Identity
from protocol.keys import Keys
from protocol.messages import Meter, State, Strike, decode
from protocol.session import open_client

KINDS = {"state": State, "meter": Meter, "strike": Strike}


def main() -> None:
    rig, endpoint, *files = sys.argv[1:]
    session = open_client(endpoint, lambda: True, Identity(*map(Path, files)) if files else None)
    assert session is not None
    keys = Keys(rig)
    one_at_a_time = threading.Lock()

    def hear(sample: zenoh.Sample) -> None:
        kind = str(sample.key_expr).rpartition("/")[2]
        message = decode(sample.payload.to_bytes(), KINDS[kind])
        line = json.dumps([kind, time.monotonic(), msgspec.to_builtins(message)])
        with one_at_a_time:
            print(line, flush=True)

    heard = [session.declare_subscriber(key, hear) for key in (keys.state, keys.meter, keys.strike)]
    assert heard
    sys.stdin.read()  # until the test closes it
    session.close()


if __name__ == "__main__":
    main()
